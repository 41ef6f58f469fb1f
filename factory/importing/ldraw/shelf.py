"""Where LDraw files are found: packed in the model, beside it, or in a parts library."""

from __future__ import annotations

from pathlib import Path, PurePosixPath

from factory.importing.draft import ImportFaults
from factory.importing.ldraw.colours import common_colours
from factory.importing.ldraw.lines import LDrawFile, key_of, read_lines
from factory.lang.source import quoted, read_text, source_of
from factory.support.errors import Position

ROOMS = ("parts", "p", "models", "unofficial/parts", "unofficial/p")
"""Where a library keeps files, in the order in which they are looked for."""


class Shelf:
    """The files that a model can refer to. Each is read once, when it is asked for."""

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

    def find(self, name: str, position: Position) -> LDrawFile | None:
        """The file of this name; None if there is none. A name that leads out of the folders is
        noted as a fault (BadPath)."""
        key = key_of(name)
        if key not in self.files:
            self.files[key] = self._search(name, position)
        return self.files[key]

    def _search(self, name: str, position: Position) -> LDrawFile | None:
        inside = PurePosixPath(name.replace("\\", "/"))
        if inside.is_absolute() or ".." in inside.parts or ":" in name or "\0" in name:
            message = f"{quoted(name)} leads out of the model's folder and the library"
            self.faults.add("BadPath", message, position, "name a file in one of them")
            self.refused.add(key_of(name))
            return None
        for folder in self.folders:
            for spelled in dict.fromkeys((str(inside), str(inside).lower())):
                path = folder / spelled
                if _is_file(path):
                    return self._read(path, name)
        return None

    def _read(self, path: Path, name: str) -> LDrawFile:
        files = read_lines(source_of(read_text(path), str(path)), name, self.faults)
        for file in files:
            self.files.setdefault(key_of(file.name), file)
        return files[0]


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
