"""The error of `plan` for parts that interlock, with its pictures."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from factory.api import InputError
from factory.commands.requests import OutputOptions
from factory.commands.warnings import announced
from factory.support.errors import MissingError
from factory.support.progress import Waiting

if TYPE_CHECKING:
    from factory.apps.planning.parts import InPlace
    from factory.apps.planning.plan import CannotAssemble

DRAWN = 6
"""Maximum number of pictures, one for each set of interlocked parts."""


def refuse(
    placed: InPlace, why: CannotAssemble, folder: Path, look: bool, out: OutputOptions
) -> int:
    """Print why there is no assembly tree, and draw it; returns the exit status."""
    from factory.apps.planning.outcome import refusal
    from factory.support.console import fail

    pictures = _interlocked(placed, why, folder, out) if look else []
    details = {
        "interlocks": [lock.as_json() for lock in why.interlocks],
        "removal": {"labels": list(why.removal.labels), "smallest": why.removal.smallest},
        "files": [str(path) for path in pictures],
    }
    return fail(InputError(refusal(why, pictures)), out.as_json, details)


def _interlocked(
    placed: InPlace, why: CannotAssemble, folder: Path, out: OutputOptions
) -> list[Path]:
    """Pictures of the first sets of interlocked parts; none, with a warning, on a machine without
    GL."""
    from factory.apps.importing.draft import file_stem
    from factory.apps.planning.interlocked import InterlockedView
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
