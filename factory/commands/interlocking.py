"""What `plan` says, and draws, of parts that interlock."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from factory.commands.requests import OutputOptions
from factory.commands.warnings import announced
from factory.nets.verdict import listing
from factory.support.errors import Diagnostic, InputError, MissingError
from factory.support.progress import Waiting

if TYPE_CHECKING:
    from factory.planning.cannot import Interlock
    from factory.planning.parts import InPlace
    from factory.planning.plan import CannotAssemble

DRAWN = 6
"""So many sets of parts that interlock, the first ones, get a picture."""


def refuse(
    found: InPlace, why: CannotAssemble, folder: Path, look: bool, out: OutputOptions
) -> int:
    """Say that there is no tree, and why, with pictures; gives the exit status."""
    from factory.support.console import fail

    pictures = _interlocked(found, why, folder, out) if look else []
    details = {
        "interlocks": [lock.as_json() for lock in why.interlocks],
        "removal": {"labels": list(why.removal.labels), "smallest": why.removal.smallest},
        "files": [str(path) for path in pictures],
    }
    return fail(InputError(cannot(why, pictures)), out.as_json, details)


def cannot(found: CannotAssemble, pictures: list[Path]) -> Diagnostic:
    """That parts interlock, what shows it, and what would help."""
    stuck = "; ".join(map(_held, found.interlocks))
    more = " and ".join(found.removal.labels)
    fewest = "the fewest parts" if found.removal.smallest else "perhaps fewer suffice"
    pairs = [":".join(lock.labels) for lock in found.interlocks if len(lock.labels) == 2]
    every = len(pairs) == len(found.interlocks)
    options = " ".join(f"--allow {name}" for name in (pairs if every else found.removal.labels))
    shown = f" (see {listing(map(str, pictures), 2)})" if pictures else ""
    message = f"no straight motion along x, y or z separates these parts: {stuck}{shown}"
    hint = f"without {more} the rest can be joined ({fewest}); {options} accepts the clash"
    if found.needs:
        from factory.planning.posing import in_words

        ways = [f"{listing(labels)} along {in_words(way)}" for labels, way in found.needs]
        hint = f"no orientation aligns all motions with axes ({'; '.join(ways)}); {hint}"
    return Diagnostic("CannotAssemble", message, None, hint)


def _held(lock: Interlock) -> str:
    """Parts that interlock, and the two of them that hold each other by least."""
    from factory.planning.cannot import named

    words = listing(lock.labels)
    if lock.clashes:
        least = lock.clashes[0]
        by = f"by {1e3 * least.depth:.2f} mm or more on each way"
        words += f" ({least.one} and {least.other} pass through each other {by},"
        words += f" least where {least.one} leaves to {named(least.way)})"
    return words


def _interlocked(
    found: InPlace, why: CannotAssemble, folder: Path, out: OutputOptions
) -> list[Path]:
    """A picture of each of the first few sets of parts that interlock; none where the machine has
    no GL, which is said."""
    from factory.importing.labels import file_stem
    from factory.render.interlocked import InterlockedView
    from factory.support.files import own_names

    locks = why.interlocks[:DRAWN]
    ends = ["", *(f"-{n}" for n in range(2, len(locks) + 1))]
    paths = [folder / f"{file_stem(found.name)}-interlocked{end}.png" for end in ends]
    own_names(folder, paths)
    try:
        with Waiting("drawing what interlocks", out.silent):
            for lock, path in zip(locks, paths, strict=True):
                InterlockedView(found, lock).still(path)
    except MissingError as error:
        announced(error.diagnostics, out)
        return []
    return paths
