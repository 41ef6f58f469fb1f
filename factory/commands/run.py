"""The command `run`, and the execution of a simulation for any command."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

import click

from factory.commands.allowing import ALLOW
from factory.commands.grouped import Grouped
from factory.commands.monitor import found_by, say_failures, say_verdict, tell_failures
from factory.commands.options import (
    FAULTS,
    FLOOR,
    LENIENT,
    MOTION,
    OUTPUT,
    PATH,
    PICTURE,
    RELAY,
    RUN,
    SOURCE,
)
from factory.commands.outputs import for_a_film, writable
from factory.commands.requests import (
    OutputOptions,
    PictureOptions,
    ProjectOptions,
    RunOptions,
    check_ideal,
)
from factory.commands.resuming import resumed
from factory.commands.warnings import announced, say_allowed
from factory.support.console import POOL_BOUND, emit, say, table
from factory.support.errors import Diagnostic, StoppedError, usage_error
from factory.support.progress import Progress, Waiting

if TYPE_CHECKING:
    from factory.pipeline import Project
    from factory.plant.factory import Factory
    from factory.record.figures import PhysicsFigures
    from factory.record.state import Recorder
    from factory.rendering import Film
    from factory.simulation.resuming import Resumed
    from factory.simulation.run import Run
    from factory.simulation.simulation import Simulation

    Filming = Callable[[Simulation], Film]
    Opening = Callable[[], Recorder]
    """Opens a recorder of a run, such as a log, as a context."""


@click.command(cls=Grouped)
@SOURCE
@FAULTS
@RUN
@ALLOW
@click.option("--video", type=PATH, help="Film the run (.mp4).")
@click.option("--log", type=PATH, help="Log every tick to a file.")
@click.option(
    "--distributed", is_flag=True, help="Each robot runs its own program (paper, section 6)."
)
@click.option(
    "--monitor/--no-monitor",
    default=None,
    help="Check the run from the engine's states alone: at events (default), every tick, never.",
)
@click.option("--resume", is_flag=True, help="Continue an interrupted run, whose log is FILE.")
@LENIENT
@PICTURE
@FLOOR
@RELAY
@MOTION
@OUTPUT
def run(
    options: ProjectOptions,
    asked: RunOptions,
    shown: PictureOptions,
    out: OutputOptions,
    video: Path | None,
    log: Path | None,
    monitor: bool | None,
    resume: bool,
) -> int:
    """Run FILE.pag until its products are dropped off.

    The exit status is 1 if the run does not make its units, does not follow its net, or moves
    bodies other than the net says; --lenient ignores the last.

    With --resume, FILE is a log: its run is repeated up to the end of the log, compared with it,
    and continued in the same log."""
    if resume:
        going = resumed(options.file, asked.max_time, out)
        return 0 if going is None else _continue(going, asked, monitor, out)
    writable(options.file, video, log, shown.poster)
    project = options.project(out.silent)
    with Waiting("reading the shapes and laying out", out.silent):
        layout = project.layout
    warnings = announced(project.warnings, out)
    if not out.silent:
        say_allowed(project)
    shown.area()
    if asked.world == "ideal":
        check_ideal(asked.fuse, bool(monitor))
    film = _film(project, asked, video, shown)
    record = run_project(project, asked, out.silent, log, film, monitor)
    status = _print(record, layout.factory, warnings, monitor, out)
    if not out.as_json:
        say_files(film=video, poster=shown.poster, log=log)
    return status


def _continue(going: Resumed, asked: RunOptions, monitor: bool | None, out: OutputOptions) -> int:
    """Continue the run in a log to its end; returns the exit status."""
    made = going.simulation
    record = _judged(made, asked, out.silent, going.path, [going.recorder], monitor)
    status = _print(record, made.layout.factory, [], monitor, out)
    if not out.as_json:
        say_files(log=going.path)
    return status


def _print(
    record: Run,
    factory: Factory,
    warnings: Sequence[object],
    monitor: bool | None,
    out: OutputOptions,
) -> int:
    """Print the result of a run; returns the exit status."""
    if out.as_json:
        document = record.as_json()
        document.pop("schema")
        if monitor and record.monitor:
            document["monitor"] = record.monitor.as_json()
        trouble = [record.trouble.as_json()] if record.trouble else []
        emit({**document, "warnings": warnings, **({"errors": trouble} if trouble else {})})
    else:
        summarise(record, factory, out.verbose)
    tell_failures(record.verdict, out.verbose)
    return 0 if record.succeeded else 1


def _film(
    project: Project, asked: RunOptions, video: Path | None, shown: PictureOptions
) -> Filming | None:
    """The film that the options describe; None without --video. Raises InputError for a run that
    cannot be filmed, MissingError without GL."""
    if video is None:
        for_a_film()
        return None
    if asked.world == "ideal":
        raise usage_error("the ideal world has no bodies to film", "leave out --world ideal")
    from factory.rendering import Film, check_output
    from factory.support.gl import probe

    check_output(video, shown.area(), shown.fps)
    picture = shown.picture(project.pag)
    probe()
    return lambda made: Film(made, video, picture, shown.fps, shown.poster)


def run_project(
    project: Project,
    asked: RunOptions,
    silent: bool,
    log: Path | None = None,
    film: Filming | None = None,
    monitor: bool | None = None,
) -> Run:
    """One run, with a log and a film if options. `monitor`: True for a monitor that observes every
    tick, False for none, None for one that observes events."""
    from factory.nets.verify import proved
    from factory.simulation.simulation import Simulation

    proved(project.factory.net)
    seen = log is not None or film is not None
    with Waiting("compiling the model", silent):
        made = Simulation(project.layout, asked.request(project, seen))
        if asked.recovers:
            from factory.simulation.recovery import recover

            recover(made, asked.campaign(project.layout.factory))
    recorders: list[Opening] = []
    if log is not None:
        from factory.record.log import LogWriter

        recorders.append(lambda: LogWriter(log, made, project))
    if film is not None:
        recorders.append(lambda: film(made))
    return _judged(made, asked, silent, log, recorders, monitor)


def _judged(
    made: Simulation,
    asked: RunOptions,
    silent: bool,
    log: Path | None,
    recorders: Sequence[Opening],
    monitor: bool | None,
) -> Run:
    """A run with its verdict, as the options describe."""
    record = carry_out(made, silent, asked.max_time, recorders, monitor, log)
    account = made.world.hooks.account
    failures = None if account is None else account.report()
    if failures is not None and log is not None and monitor is not False and made.model is not None:
        from factory.record.log import read_log
        from factory.record.monitor.record import watch_log

        with Waiting("judging the run between failures", silent):
            record = replace(record, monitor=watch_log(read_log(log))[0])
    return replace(record, lenient=asked.lenient, failures=failures)


def carry_out(
    made: Simulation,
    silent: bool,
    max_time: float | None = None,
    recorders: Sequence[Opening] = (),
    monitor: bool | None = None,
    log: Path | None = None,
) -> Run:
    """A run with a progress bar. A signal stops it at the end of a tick, so that the recorders'
    files are complete; StoppedError then says how far it came and how to continue the run in a
    `log`. Recorders see every tick only from their `since` on."""
    from factory.record.ending import CutOff
    from factory.simulation.watched import watched
    from factory.support.interruption import Interruption

    since = 0.0
    try:
        with Interruption() as stop, ExitStack() as stack:
            opened = [stack.enter_context(recorder()) for recorder in recorders]
            since = max((recorder.since for recorder in opened), default=0.0)
            bar = stack.enter_context(Progress(made.request.units, silent, made.duration))
            seeing, glances = [r.observe for r in opened], [stop.observe, bar.observe]
            if monitor is False:
                record = made.run(seeing, max_time, glances, since)
            else:
                record = watched(made, seeing, max_time, glances, bool(monitor), since)
            for recorder in opened:
                recorder.end(record.trouble)
            return record
    except KeyboardInterrupt as error:
        came = CutOff(made.world.time, made.world.delivered() - made.before, made.request.units)
        message = f"stopped by the user, {came}"
        if made.world.time < since:
            message = f"stopped by the user before {since:.2f} s, so '{log}' is as it was"
        hint = f"log: {log}; continue: factory run --resume {quote(str(log))}" if log else ""
        raise StoppedError(Diagnostic("Interrupted", message, None, hint)) from error


def not_tested(physics: PhysicsFigures) -> str:
    """The number of pairs of parts without collision checks, in words."""
    return f"{physics.pairs_excluded} of {physics.pairs} pairs of parts not checked for collisions"


def summarise(record: Run, factory: Factory, verbose: bool) -> None:
    """Print a run in a few lines; the first line of a failed run says why."""
    if not record.succeeded:
        say_verdict(record.verdict, verbose)
    cycle = f"{record.cycle_time_s:.3f} s" if record.cycle_time_s is not None else "not yet steady"
    of_all = " with all robots" if record.exchanges else ""
    say(
        f"{record.products} of {record.units} products in {record.sim_time_s:.2f} s "
        f"({record.realtime_factor:.1f} times real time, {record.world})"
    )
    say(
        f"cycle time {cycle}, predicted {record.predicted_cycle_time_s:.3f} s{of_all}; "
        f"bottleneck {record.bottleneck}"
    )
    say(
        f"{record.fired} transitions fired, "
        f"the record {'refines' if record.replays else 'DOES NOT REFINE'} the net"
    )
    physics = record.physics
    if physics is not None:
        chosen = physics.timestep_chosen
        how = "chosen automatically (--timestep)" if chosen else "as requested"
        say(f"timestep {1000 * physics.timestep_s:g} ms, {how}")
        if physics.wip_chosen:
            say(f"at most {physics.wip_chosen} units inside at once: {POOL_BOUND}")
        error = physics.product_error_max_mm
        contacts = f"{physics.unintended_contacts} unintended contacts"
        warnings = f"{physics.engine_warnings} engine warnings"
        say(
            f"{physics.handoffs} hand-offs, largest gap {physics.handoff_gap_max_mm:.3f} mm; "
            f"product error {'none measured' if error is None else f'{error:.3f} mm'}, "
            f"{physics.joining_error_max_mm:.3f} mm when grips close; "
            + (warnings if physics.excluded else f"{contacts}, {warnings}")
        )
        if physics.grip_gap_max_mm is not None:
            say(f"largest gap between part and gripper: {physics.grip_gap_max_mm:.3f} mm")
        if physics.grip_strength_share_max is not None:
            where = f"{physics.grip_strength_robot} with '{physics.grip_strength_label}'"
            used = 100 * physics.grip_strength_share_max
            say(f"highest grip load: {used:.0f} % of the hand's strength ({where})")
        if physics.excluded:
            say(f"{contacts}; {not_tested(physics)}{'' if verbose else ' (list: -v)'}")
        for one, other in physics.excluded if verbose else ():
            say(f"  not checked: {one} - {other}")
        for pair in physics.contacts[:8]:
            say(f"  contact: {pair}")
        if physics.mating_forces:
            most = max(physics.mating_forces, key=physics.mating_forces.__getitem__)
            say(f"largest force between inputs: {physics.mating_force_max_n:.3f} N, in {most}")
        if physics.fused:
            say("parts joined for good are merged into one rigid body (--no-fuse: kept separate)")
    if record.failures is not None:
        say_failures(record.failures, verbose)
    for exchange in record.exchanges:
        say(f"{exchange.t:.2f} s: {exchange}")
    if record.monitor is not None:
        say(found_by(record.monitor, record.cut_off))
    if record.succeeded:
        say_verdict(record.verdict, verbose)
    busy = sorted(zip(factory.robots, record.utilisation, strict=True), key=lambda p: -p[1])
    rows = [(r.name, r.type, f"{100 * u:.0f} %") for r, u in (busy if verbose else busy[:6])]
    table("Utilisation", ("robot", "type", "busy"), rows)
    if more := len(busy) - len(rows):
        say(f"... and {more} more robot{'s' if more > 1 else ''} (-v shows all)")


def say_files(**files: Path | None) -> None:
    """Print the files that a run has written, by their kinds."""
    for kind, path in files.items():
        if path is not None:
            say(f"{kind}: {path}")
