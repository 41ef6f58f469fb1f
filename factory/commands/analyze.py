"""The command `analyze`."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factory.commands.options import (
    DRAW,
    FLOOR,
    MOTION,
    OUTPUT,
    PATH,
    RELAY,
    SOURCE,
    WIP,
    for_a_pag,
    plan,
    settings_of,
)
from factory.commands.options import writable as check_writable
from factory.support.console import emit, say, table, warn
from factory.support.errors import Diagnostic, InputError, did_you_mean

if TYPE_CHECKING:
    from factory.plant.factory import Factory
    from factory.study.analysis import Change, Timing
    from factory.study.analysis.measured import RunRecord
    from factory.study.analysis.recorded import Conditions


@click.command()
@SOURCE
@click.option("--units", type=click.IntRange(1, 10_000), default=20, help="Products to look at.")
@click.option(
    "--world",
    type=click.Choice(["mujoco", "ideal"]),
    default="mujoco",
    help="Whose times: MuJoCo's, or those of the paper's ideal world.",
)
@DRAW
@WIP
@click.option("--second", "seconds", multiple=True, help="What if: another such robot, as r4.")
@click.option("--faster", multiple=True, help="What if: a robot faster by so many percent, r4=20.")
@click.option("--shorter", multiple=True, help="What if: its ways shorter by percent, r4=20.")
@click.option("--measured", type=PATH, help="Compare with the LOG of a run, made as that was.")
@click.option("--run", "on_the_spot", is_flag=True, help="Compare with a run of these units.")
@click.option("--delays", type=PATH, help="For a net in PNML: a TOML file of place = seconds.")
@click.option("-o", "--output", type=PATH, help="A picture: .svg or .png.")
@FLOOR
@RELAY
@MOTION
@OUTPUT
def analyze(
    file: Path,
    folders: tuple[Path, ...],
    delays: Path | None,
    output: Path | None,
    as_json: bool,
    quiet: bool,
    verbose: bool,
    **options: Any,
) -> int:
    """Say what sets the pace of FILE.pag (or of a net in FILE.pnml), and what would change it."""
    from factory.support.files import is_net

    if is_net(file):
        for_a_pag(file, "a net in PNML", "delays", "output")
        return _analyze_net(file, delays, output, as_json, quiet, verbose)
    if delays is not None:
        message = "--delays is for a net in PNML; of a PAG, delays follow from its layout"
        raise InputError(Diagnostic("Usage", message, None, "leave it out"))
    return _analyze_pag(file, folders, output, as_json, quiet, verbose, options)


def _analyze_net(
    file: Path, delays: Path | None, output: Path | None, as_json: bool, quiet: bool, verbose: bool
) -> int:
    from factory.foreign_nets.pnml_reader import read_pnml
    from factory.lang.source import read_text
    from factory.study.analysis.general import analyse_net, net_document, net_tables, read_delays

    if output is not None:
        message = "a net has no robots to draw"
        raise InputError(Diagnostic("Usage", message, None, "leave out -o"))
    if delays is None:
        message = "a net needs a table of delays"
        hint = '--delays FILE.toml, with lines as "p1" = 0.5'
        raise InputError(Diagnostic("Usage", message, None, hint))
    net = read_pnml(read_text(file), str(file))
    found = analyse_net(net, read_delays(delays, net), str(file))
    if as_json:
        emit(net_document(file.stem, found))
    elif not quiet:
        say(f"{file.stem}: cycle time {found.pace:.6g} s")
        for made in net_tables(found, verbose):
            table(made.title, made.columns, made.rows)
    return 0


def _analyze_pag(
    file: Path,
    folders: tuple[Path, ...],
    output: Path | None,
    as_json: bool,
    quiet: bool,
    verbose: bool,
    options: dict[str, Any],
) -> int:
    from factory.nets.verify import proved
    from factory.study.analysis import Timing, analyse
    from factory.study.analysis.document import document
    from factory.study.analysis.picture import check_picture, picture
    from factory.support.files import write_bytes

    check_writable(file, output)
    check_picture(output)
    log = _log(options["measured"], options["on_the_spot"])
    made = _conditions(file, log, options)
    source, factory, layout = plan(file, folders, made.settings, options["floor"], options)
    proved(factory.net)
    warn(layout.product.warnings, quiet)
    timing = Timing(layout, made.settings, made.world, made.seed, made.jitter)
    asked = _asked(factory, options)
    record: RunRecord | None = None
    status = 0
    if log is not None:
        record = _logged(str(options["measured"]), log, factory)
    elif options["on_the_spot"]:
        record, status = _run(source, timing, options["units"], made.wip, quiet or as_json)
    units = len(record.dropoffs) if record else options["units"]
    found = analyse(timing, units, made.wip, asked, record)
    if output is not None:
        write_bytes(output, picture(found, output.suffix))
    if as_json:
        emit({**document(found), "picture": str(output) if output else None})
    elif not quiet:
        _tell(found, verbose)
        if output is not None:
            say(f"wrote {output}")
    return status


def _tell(found: Any, verbose: bool) -> None:
    from factory.study.analysis.tables import summary, tables

    for line in summary(found):
        say(line)
    for made in tables(found, verbose):
        table(made.title, made.columns, made.rows)
        if made.note:
            say(f"{made.note}\n")


def _log(path: Path | None, on_the_spot: bool) -> Any:
    if path is None:
        return None
    if on_the_spot:
        message = "--measured LOG and --run exclude each other"
        raise InputError(Diagnostic("Usage", message, None, "leave one out"))
    from factory.record.log import read_log

    return read_log(path)


def _conditions(file: Path, log: Any, options: dict[str, Any]) -> Conditions:
    """How the run was made, or is to be made."""
    from factory.study.analysis.recorded import Conditions, conditions

    if log is not None:
        return conditions(log.header)
    settings = settings_of(file, options)
    return Conditions(
        settings, options["world"], options["seed"], options["jitter"], options["wip"]
    )


def _logged(name: str, log: Any, factory: Factory) -> RunRecord:
    from factory.study.analysis.recorded import check_log, check_products, logged_record

    check_log(name, log.header, factory)
    record = logged_record(name, log.events, log.time, log.delivered)
    check_products(record)
    return record


def _run(
    source: Any, timing: Timing, units: int, wip: int | None, quiet: bool
) -> tuple[RunRecord, int]:
    """A run on the spot; status 1 where it was troubled."""
    from factory.simulation.request import RunRequest
    from factory.simulation.simulation import Simulation
    from factory.study.analysis.recorded import check_products, record_of
    from factory.support.interruption import Interruption
    from factory.support.progress import Progress

    request = RunRequest(
        timing.world,
        units,
        timing.seed,
        timing.jitter,
        timing.settings,
        wip=wip,
        shown=False,
        catalogue=source.catalogue,
    )
    simulation = Simulation(timing.layout, request)
    with ExitStack() as stack:
        stop, bar = Interruption(), Progress(units, quiet)
        glances = [stack.enter_context(stop).observe, stack.enter_context(bar).observe]
        run = simulation.run(glances=glances)
    if run.trouble is not None:
        print(run.trouble, file=sys.stderr)
    record = record_of(run)
    check_products(record)
    return record, 0 if run.trouble is None else 1


def _asked(factory: Factory, options: dict[str, Any]) -> tuple[str, Change] | None:
    """The change that the options ask about, in words. Raises InputError."""
    from factory.study.analysis import Change

    robots = {robot.name: robot.index for robot in factory.robots}
    copies = {_robot(robots, name): 1 for name in options["seconds"]}
    for name in options["seconds"]:
        copies[robots[name]] += 1
    speed = dict(_percent(robots, text, "--faster", 1e6) for text in options["faster"])
    way = dict(_percent(robots, text, "--shorter", 100.0) for text in options["shorter"])
    names = factory.robots
    words = [f"{count} × {names[r].name}" for r, count in copies.items()]
    words += [f"{names[r].name} {100 * share:g} % faster" for r, share in speed.items()]
    words += [f"ways of {names[r].name} {100 * share:g} % shorter" for r, share in way.items()]
    if not words:
        return None
    change = Change(
        speed={robot: 1 + share for robot, share in speed.items()},
        way={robot: 1 - share for robot, share in way.items()},
        copies=copies,
    )
    return ", ".join(words), change


def _robot(robots: dict[str, int], name: str) -> int:
    if name not in robots:
        hint = did_you_mean(name, list(robots), "robots")
        raise InputError(Diagnostic("Usage", f"there is no robot '{name}'", None, hint))
    return robots[name]


def _percent(robots: dict[str, int], text: str, option: str, most: float) -> tuple[int, float]:
    """`r4=20` as a robot and a share, of more than 0 and at most `most` percent."""
    name, _, number = text.partition("=")
    try:
        percent = float(number)
        if not 0 < percent <= most:
            raise ValueError
    except ValueError:
        message = f"{option} takes a robot and percent above 0, at most {most:g}, not '{text}'"
        hint = f"for example {option} r1=20"
        raise InputError(Diagnostic("BadValue", message, None, hint)) from None
    return _robot(robots, name), percent / 100
