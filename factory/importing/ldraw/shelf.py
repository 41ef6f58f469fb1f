"""The search for LDraw files: packed in the model, beside it, or in a parts library."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator, Set
from pathlib import Path

from factory.importing.draft import ImportFaults
from factory.importing.ldraw.lines import (
    LDrawFile,
    Reference,
    common_colours,
    key_of,
    read_lines,
)
from factory.importing.mesh_files import first_file, path_inside
from factory.lang.source import quoted, read_text, source_of

ROOMS = ("parts", "p", "models", "unofficial/parts", "unofficial/p")
"""The folders of a library, in the order of the search."""


class Shelf:
    """The files that a model refers to, each read once, at the first reference."""

    def __init__(self, path: Path, library: Path | None, faults: ImportFaults) -> None:
        self.library, self.faults = library, faults
        self.folders = [path.parent, *([library / room for room in ROOMS] if library else [])]
        self.files: dict[str, LDrawFile | None] = {}
        self.refused: set[str] = set()
        self.main = self._read(path, path.name)
        self.colours = common_colours()
        config = library / "LDConfig.ldr" if library else None
        if config is not None and config.is_file():
            self.colours |= self._read(config, config.name).colours
        for file in list(self.files.values()):
            self.colours |= file.colours if file else {}

    def find(self, reference: Reference) -> LDrawFile | None:
        """The file that a line refers to; None if there is none. A name outside the folders is
        noted as a fault (BadPath)."""
        key = key_of(reference.file)
        if key not in self.files:
            self.files[key] = self._search(reference)
        return self.files[key]

    def _search(self, reference: Reference) -> LDrawFile | None:
        inside = path_inside(reference.file)
        if inside is None:
            message = f"{quoted(reference.file)} is outside the model's folder and the library"
            self.faults.add("BadPath", message, reference.position, "name a file in one of them")
            self.refused.add(key_of(reference.file))
            return None
        names = dict.fromkeys((str(inside), str(inside).lower()))
        path = first_file(folder / name for folder in self.folders for name in names)
        return None if path is None else self._read(path, reference.file)

    def _read(self, path: Path, name: str) -> LDrawFile:
        files = read_lines(source_of(read_text(path), str(path)), name, self.faults)
        for file in files:
            self.files.setdefault(key_of(file.name), file)
        return files[0]


def children_first(
    root: LDrawFile,
    below: Callable[[LDrawFile, Set[int]], Iterable[LDrawFile]],
    done: Container[int],
) -> Iterator[LDrawFile]:
    """All files that `below` leads to from the root, each after the files below it; without
    recursion. `below` is called with the ids of the files on the way down, which must not occur
    again. Files whose ids are `done` are skipped."""
    stack, path = [(root, False)], set[int]()
    while stack:
        file, expanded = stack.pop()
        if expanded:
            path.remove(id(file))
            yield file
        elif id(file) not in done:
            path.add(id(file))
            stack.append((file, True))
            stack += [(child, False) for child in below(file, path)]
