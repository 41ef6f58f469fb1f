"""The command `plan`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

import click

from factory.apps.planning.command_line.asking import asked
from factory.apps.planning.command_line.interlocking import refuse
from factory.commands.options import LIBRARY, OUT, OUTPUT, PATH, SECONDS, TEMPLATES
from factory.commands.outputs import writable_folder
from factory.commands.requests import OutputOptions
from factory.commands.warnings import announced, say_allowed
from factory.support.bounds import AIMS, LENGTHS, UPS
from factory.support.console import emit, say
from factory.support.errors import MissingError
from factory.support.progress import StepBar, Waiting

if TYPE_CHECKING:
    from factory.api import Project
    from factory.apps.planning.parts import InPlace
    from factory.apps.planning.plan import CannotAssemble, Planned, PlannedJoin, PlanOptions
    from factory.apps.planning.searching import Aim
    from factory.floor.geometry.overlapping import Overlapping
    from factory.support.arrays import Array
    from factory.theory.plant.approaches import Approach, Kind

LOOKS = ("exploded.png", "assembly.mp4")
"""Suffixes of the names of the still and of the film."""
STOPPING = "stopping: the best tree so far is laid out; interrupt again to stop at once"
"""The message after a signal."""

UNLAID = "not laid out: the time was over before its parts were decomposed into convex bodies"
"""How good a tree is that was not laid out."""

SOON = 1e-3
"""The least time that is left to search after files are read [s]: there is a first tree."""

KINDS: tuple[Kind, ...] = ("slide", "lower", "blocked")


@click.command()
@click.argument("source", type=PATH)
@click.option("-o", "--output", type=OUT, help="Output folder (default: SOURCE-planned).")
@click.option(
    "--for",
    "aim",
    type=click.Choice(AIMS),
    default="cycle",
    help="What to minimise: cycle time, number of robots or floor area.",
)
@click.option(
    "--seconds",
    type=SECONDS,
    help="Time to read and search for a better tree [s] (default: a fixed number of candidates).",
)
@click.option("--keep", multiple=True, help="Sub-tree of a PAG to keep (repeatable).")
@click.option("--replan", is_flag=True, help="Ignore the assembly tree of a PAG.")
@click.option(
    "--allow",
    multiple=True,
    help="Part that may pass through others, or pair A:B, if nothing else works (repeatable).",
)
@click.option(
    "--up",
    type=click.Choice(UPS),
    help="Axis of SOURCE that points up (default: z, unless the product would tip over).",
)
@click.option("--base", help="Part or sub-tree to assemble the others onto.")
@click.option("--screw", "screws", multiple=True, help="Part that is a screw (repeatable).")
@click.option("--no-screws", is_flag=True, help="Treat no part as a screw.")
@click.option(
    "--hulls", is_flag=True, help="Plan with convex hulls, even where they hide openings."
)
@click.option("--unit", type=click.Choice(LENGTHS), help="Unit of lengths (default: detected).")
@click.option("--in-place", is_flag=True, help="Assume that the parts are in place.")
@LIBRARY
@click.option("--boxes", is_flag=True, help="Use boxes for LDraw parts without a shape.")
@click.option("--look/--no-look", default=True, help="Write an exploded view and its film.")
@TEMPLATES
@OUTPUT
def plan(
    out: OutputOptions,
    source: Path,
    output: Path | None,
    aim: Aim,
    seconds: float | None,
    keep: tuple[str, ...],
    replan: bool,
    allow: tuple[str, ...],
    up: str | None,
    base: str | None,
    screws: tuple[str, ...],
    no_screws: bool,
    hulls: bool,
    unit: str | None,
    in_place: bool,
    library: Path | None,
    boxes: bool,
    look: bool,
    folders: tuple[Path, ...],
) -> int:
    """Plan the assembly of parts that are given in place.

    The assembly tree is written as a PAG with its meshes. SOURCE is a folder of meshes, a file with
    named bodies (.glb, .3mf, .step), an LDraw model (.ldr, .mpd), or a PAG whose assembly tree is
    to be ignored; all parts are where they are in the finished product.
    """
    from factory.api import all_templates
    from factory.apps.few_robots.sharing import with_lines
    from factory.apps.importing.draft import file_stem
    from factory.apps.planning.outcome import write_planned
    from factory.apps.planning.plan import CannotAssemble, PlanOptions
    from factory.apps.planning.source import SourceOptions, read_source
    from factory.pipeline import read
    from factory.support.files import own_names
    from factory.theory.lang.overlaps import overlaps_in

    templates = all_templates(folders)
    writable_folder(output)

    reading = 0.0

    def read_as(options: SourceOptions) -> InPlace:
        nonlocal reading
        begin = monotonic()
        with Waiting(f"reading {source.name}", out.silent):
            made = read_source(source, templates, options)
        reading = monotonic() - begin
        return made

    fast = None if no_screws else screws
    options = SourceOptions(unit, keep, replan, library, boxes, in_place, fast)
    placed = asked(read_as, options, out.silent)
    meant, allow = overlaps_in(allow, {part.label for part in placed.parts})
    placed = replace(placed, allowed=(*placed.allowed, *meant))
    folder = output or Path(f"{placed.name}-planned")
    writable_folder(folder)
    stem = file_stem(placed.name)
    names = f"{stem}.pag", *placed.files, *_looks_of(stem)
    own_names(folder, (folder / name for name in names))
    warnings = announced(placed.warnings, out)
    if not out.as_json:
        for note in placed.notes:
            say(f"  {note}")
    side = UPS[up] if up else None
    left = None if seconds is None else max(SOON, seconds - reading)
    search = PlanOptions(aim, left, allow, hulls, side, base or "", fast, templates=templates)
    planned, stopped = _sought(placed, search, out)
    if isinstance(planned, CannotAssemble):
        return refuse(placed, planned, folder, look, out)
    files = write_planned(placed, planned, folder, source, allow, templates)
    written = read(files[0], folders)
    if not planned.figures.layouts:
        if out.as_json:
            emit(_document(placed, planned, written, [*files], warnings))
        else:
            _print(placed, planned, written, out)
        return 0
    shapes = (planned.project or written).product
    project = with_lines(written.with_product(shapes, as_drawn=True), planned.lines)
    if stopped and not out.silent:
        say("  stopped: the best tree so far, without pictures")
    announced_before = set(map(id, project.product.warnings))
    warnings += announced([w for w in project.warnings if id(w) not in announced_before], out)
    if not out.silent:
        say_allowed(project)
    if not out.as_json:
        _print(placed, planned, project, out)
    looked = _looks(project, out) if look and not stopped else []
    if out.as_json:
        emit(_document(placed, planned, project, [*files, *looked], warnings))
    else:
        _print_files([*files, *looked], out)
    return 1 if project.matings and project.matings.faults(project.pag.allowed) else 0


def _sought(
    placed: InPlace, asked: PlanOptions, out: OutputOptions
) -> tuple[Planned | CannotAssemble, bool]:
    """The best plan found within the time or until a signal, or the reason why there is none; and
    whether there was a signal. Before a first tree is found a signal is raised at once."""
    from factory.apps.planning.plan import DECOMPOSING, LAYING
    from factory.apps.planning.plan import plan as sought
    from factory.support.interruption import Interruption

    with (
        Interruption(False, lambda: print(STOPPING, file=sys.stderr)) as stop,
        StepBar("searching for a tree", out.silent, asked.seconds) as bar,
    ):

        def show(what: str, done: int, total: int | None, words: str) -> None:
            stop.keeps = what == DECOMPOSING or (done > 0 and what != LAYING)
            bar.show(what, done, total, words)

        search = replace(asked, told=show, stopped=lambda: stop.noted)
        return sought(placed, search), stop.noted


def _looks(project: Project, out: OutputOptions) -> list[Path]:
    """The still and the film of the exploded view, written beside the PAG; none, with a warning, on
    a machine without GL."""
    from factory.apps.planning.exploded import ExplodedView
    from factory.apps.planning.exploding import explosion

    still, film = map(project.file.with_name, _looks_of(project.name))
    if project.matings is None:
        return []
    view = ExplodedView(project.product, explosion(project.pag, project.matings, project.product))
    try:
        with Waiting("drawing and filming the exploded view", out.silent):
            view.still(still)
            view.film(film)
    except MissingError as error:
        announced(error.diagnostics, out)
        return []
    return [still, film]


def _looks_of(name: str) -> list[str]:
    """The names of the still and of the film of a product of this name."""
    return [f"{name}-{end}" for end in LOOKS]


def _document(
    placed: InPlace,
    planned: Planned,
    project: Project,
    files: list[Path],
    warnings: list[dict[str, Any]],
) -> dict[str, Any]:
    """The keys of `plan --json`."""
    matings = project.matings if planned.figures.layouts else None
    by_label = _by_label(placed, planned, project) if matings else {}
    labels = {id(join): label for label, join in by_label.items()}
    joins = planned.operations if matings else ()
    return {
        **({"hulls": [asdict(pair) for pair in planned.hidden]} if planned.hidden else {}),
        "pag": str(project.file),
        "product": project.pag.root,
        "parts": len(placed.parts),
        "kinds": len({part.kind for part in placed.parts}),
        "labels": len(project.pag),
        "kept": [keep.label for keep in placed.kept],
        "notes": [*placed.notes, *planned.notes],
        "orientation": planned.orientation.tolist(),
        "figures": asdict(planned.figures),
        "optimal": planned.optimal,
        "joins": [{"label": labels[id(join)], **asdict(join)} for join in joins],
        "approaches": matings.as_json() if matings else None,
        "files": [str(path) for path in files],
        "warnings": warnings,
    }


def _by_label(placed: InPlace, planned: Planned, project: Project) -> dict[str, PlannedJoin]:
    """The joins of a plan by the labels of their operations: each is that of the first operation
    that has all its units. A join omits screws that are driven earlier; operations of sub-trees
    that were kept have none."""
    made = {frozenset((*join.pile, *join.come)): join for join in planned.operations}
    inside = {part.label: frozenset([label]) for label, parts in placed.units() for part in parts}
    for node in project.pag.postorder():
        if node.inputs:
            inside[node.label] = frozenset[str]().union(*(inside[name] for name in node.inputs))
    joins: dict[str, PlannedJoin] = {}
    for mating in project.matings.all if project.matings else ():  # inputs before what takes them
        units = frozenset[str]().union(*(inside[name] for name in mating.inputs))
        inside[mating.label] = units
        if (whole := next((key for key in made if key <= units), None)) is not None:
            joins[mating.label] = made.pop(whole)
    return joins


def _print(placed: InPlace, planned: Planned, project: Project, out: OutputOptions) -> None:
    """Print the plan, before its pictures are drawn: these take longer than most plans do."""
    parts = sum(1 for _ in project.pag.parts())
    figures = planned.figures
    matings = project.matings if figures.layouts else None
    operations = len(matings.all) if matings else len(project.pag) - parts
    kinds = [(kind, len(matings.of_kind(kind))) for kind in KINDS] if matings else []
    ways = ", ".join(f"{count} {kind}" for kind, count in kinds if count)
    ways += _for_hulls(planned.hidden)
    by_kind = f"; ways: {ways}" if ways else ""
    say(f"{project.file}: {parts} parts, {operations} operations{by_kind}")
    for note in planned.notes:
        say(note)
    best = "optimal by estimate" if planned.optimal else "the best found"
    best = best if figures.layouts else UNLAID
    cycle = f", cycle time about {figures.cycle or figures.expected:.2f} s"
    say(f"{figures.robots} robots{cycle}; {best}")
    if out.verbose and matings:
        joins = _by_label(placed, planned, project)
        for mating in matings.all:
            way = _way(mating.approach, planned.orientation)
            words = f"{mating.label}: {' + '.join(mating.inputs)}, {way}"
            join = joins.get(mating.label)
            if join:
                words += f", {_room(join.clearance)}{_for_hulls(_hidden_at(join, placed, planned))}"
            say(f"  {words}")
    say(f"  factory run {project.file} --units 3 --video {project.file.with_suffix('.mp4')}")


def _print_files(files: Sequence[Path], out: OutputOptions) -> None:
    """Print the files that were written: the pictures alone unless it is verbose."""
    for path in files if out.verbose else files[-2:]:
        say(f"  {path}")


def _way(approach: Approach, orientation: Array) -> str:
    """The approach of an operation in words, with directions in the frame of the source."""
    from factory.apps.planning.posing import in_words

    if approach.kind == "lower":
        return f"{approach.told} from {in_words(orientation[2])}"
    ways = [in_words(side * orientation[approach.axis]) for side in approach.sides]
    return f"{'slides' if approach.kind == 'slide' else 'is blocked'} from {' or '.join(ways)}"


def _hidden_at(join: PlannedJoin, placed: InPlace, planned: Planned) -> list[Overlapping]:
    """The pairs of parts of an operation whose overlap is hidden by convex hulls."""
    units = {part.label: label for label, parts in placed.units() for part in parts}
    return [
        pair
        for pair in planned.hidden
        for one, other in [(units[pair.one], units[pair.other])]
        if (one in join.pile and other in join.come) or (other in join.pile and one in join.come)
    ]


def _for_hulls(pairs: Sequence[Overlapping]) -> str:
    """The number of pairs that were planned with convex hulls, in words."""
    some = "a pair overlaps" if len(pairs) == 1 else f"{len(pairs)} pairs overlap"
    return f", for hulls only: {some}" if pairs else ""


def _room(clearance: float) -> str:
    """The smallest clearance on an approach, in words."""
    if clearance == float("inf"):
        return "nothing near"
    room = round(1e3 * clearance, 2)
    return f"room {abs(room):.2f} mm" if room >= 0 else f"drawn {-room:.2f} mm into each other"
