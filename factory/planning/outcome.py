"""The outcome of planning: the files of a product, or the error of parts that no tree joins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from factory.nets.verdict import listing
from factory.planning.cannot import Interlock, named
from factory.planning.parts import InPlace
from factory.planning.plan import CannotAssemble, Planned
from factory.planning.posing import in_words
from factory.planning.writing import planned_product
from factory.problem.template import Template
from factory.support.errors import Diagnostic
from factory.support.files import own_names, write_all


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
    made = planned_product(placed, *tree, source.name, allow, templates)
    files = {folder / name: content for name, content in made.files.items()}
    own_names(folder, files)
    write_all(files)
    return tuple(files)


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
