"""The outcome of planning: the files of a product, or the error of parts that no tree joins."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from factory.api import Diagnostic, InputError, Settings, Template
from factory.apps.planning.cannot import Interlock, named
from factory.apps.planning.parts import InPlace
from factory.apps.planning.plan import CannotAssemble, Planned
from factory.apps.planning.posing import in_words
from factory.apps.planning.writing import planned_product
from factory.support.errors import listing
from factory.support.files import head_of, own_names, write_all

HEAD = b"# written by `factory plan`: equal screws are brought by one robot, and driven in by one\n"
"""The first line of the settings that are written with a plan."""


def write_planned(
    placed: InPlace,
    planned: Planned,
    folder: Path,
    source: Path,
    allow: Sequence[str],
    templates: Mapping[str, Template],
) -> tuple[Path, ...]:
    """Write the PAG of a plan and its meshes into a folder; gives their paths, that of the PAG
    first. `allow`: units, or pairs of them, that may pass through others. Raises InputError where a
    file would be written over the source or through a link."""
    tree = planned.tree, planned.orientation
    made = planned_product(placed, *tree, source.name, allow, templates, planned.screws)
    files = {folder / name: content for name, content in made.files.items()}
    files |= _settings(folder / Settings.FILE, planned.lines)
    own_names(folder, files)
    write_all(files)
    return tuple(files)


def _settings(file: Path, lines: Sequence[Sequence[str]]) -> dict[Path, bytes]:
    """The settings beside the PAG, with the screws that share robots; none if there are none, and
    nobody had written any. Raises InputError (BadFile) where the file is somebody else's."""
    there = head_of(file, len(HEAD)) if file.exists() else HEAD
    if not lines and (there != HEAD or not file.exists()):
        return {}
    if there != HEAD:
        rows = ", ".join(f"screws{n} = {_row(line)}" for n, line in enumerate(lines, 1))
        message = f"'{file}' is not of a plan, and would be written over"
        hint = f"choose another folder, or move it and add [lines] {rows} to yours afterwards"
        raise InputError(Diagnostic("BadFile", message, None, hint))
    rows = "".join(f"screws{n} = {_row(line)}\n" for n, line in enumerate(lines, 1))
    return {file: HEAD + (f"\n[lines]\n{rows}" if lines else "").encode()}


def _row(line: Sequence[str]) -> str:
    return json.dumps(list(line), ensure_ascii=False)


def refusal(why: CannotAssemble, pictures: Sequence[Path] = ()) -> Diagnostic:
    """The error: the interlocked parts, their pictures, and a remedy."""
    stuck = "; ".join(map(_held, why.interlocks))
    more = " and ".join(why.removal.labels)
    fewest = "the fewest parts" if why.removal.smallest else "perhaps fewer suffice"
    pairs = [":".join(lock.labels) for lock in why.interlocks if len(lock.labels) == 2]
    every = len(pairs) == len(why.interlocks)
    options = " ".join(f"--allow {name}" for name in (pairs if every else why.removal.labels))
    shown = f" (see {listing(map(str, pictures), 2)})" if pictures else ""
    message = f"no straight motion along x, y or z separates these parts: {stuck}{shown}"
    hint = f"without {more} the rest can be joined ({fewest}); {options} accepts the clash"
    if why.needs:
        ways = [f"{listing(labels)} along {in_words(way)}" for labels, way in why.needs]
        hint = f"no orientation aligns all motions with axes ({'; '.join(ways)}); {hint}"
    return Diagnostic("CannotAssemble", message, None, hint)


def _held(lock: Interlock) -> str:
    """Interlocked parts, and the pair of them with the smallest overlap on the way out."""
    words = listing(lock.labels)
    if lock.clashes:
        least = lock.clashes[0]
        by = f"by {1e3 * least.depth:.2f} mm or more on each way"
        words += f" ({least.one} and {least.other} pass through each other {by},"
        words += f" least where {least.one} leaves to {named(least.way)})"
    return words
