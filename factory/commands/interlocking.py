"""The error of `plan` for parts that interlock, with its pictures."""

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
"""Maximum number of pictures, one for each set of interlocked parts."""


def refuse(
    placed: InPlace, why: CannotAssemble, folder: Path, look: bool, out: OutputOptions
) -> int:
    """Print why there is no assembly tree, and draw it; returns the exit status."""
    from factory.support.console import fail

    pictures = _interlocked(placed, why, folder, out) if look else []
    details = {
        "interlocks": [lock.as_json() for lock in why.interlocks],
        "removal": {"labels": list(why.removal.labels), "smallest": why.removal.smallest},
        "files": [str(path) for path in pictures],
    }
    return fail(InputError(cannot(why, pictures)), out.as_json, details)


def cannot(why: CannotAssemble, pictures: list[Path]) -> Diagnostic:
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
        from factory.planning.posing import in_words

        ways = [f"{listing(labels)} along {in_words(way)}" for labels, way in why.needs]
        hint = f"no orientation aligns all motions with axes ({'; '.join(ways)}); {hint}"
    return Diagnostic("CannotAssemble", message, None, hint)


def _held(lock: Interlock) -> str:
    """Interlocked parts, and the pair of them with the smallest overlap on the way out."""
    from factory.planning.cannot import named

    words = listing(lock.labels)
    if lock.clashes:
        least = lock.clashes[0]
        by = f"by {1e3 * least.depth:.2f} mm or more on each way"
        words += f" ({least.one} and {least.other} pass through each other {by},"
        words += f" least where {least.one} leaves to {named(least.way)})"
    return words


def _interlocked(
    placed: InPlace, why: CannotAssemble, folder: Path, out: OutputOptions
) -> list[Path]:
    """Pictures of the first sets of interlocked parts; none, with a warning, on a machine without
    GL."""
    from factory.importing.labels import file_stem
    from factory.rendering.interlocked import InterlockedView
    from factory.support.files import own_names

    locks = why.interlocks[:DRAWN]
    ends = ["", *(f"-{n}" for n in range(2, len(locks) + 1))]
    paths = [folder / f"{file_stem(placed.name)}-interlocked{end}.png" for end in ends]
    own_names(folder, paths)
    try:
        with Waiting("drawing the interlocked parts", out.silent):
            for lock, path in zip(locks, paths, strict=True):
                InterlockedView(placed, lock).still(path)
    except MissingError as error:
        announced(error.diagnostics, out)
        return []
    return paths
