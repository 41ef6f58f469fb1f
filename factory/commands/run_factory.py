"""The commands `run` and `render`: a simulation with its film, log and progress."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from factory.layout.layout import Layout
from factory.nets.history import legal_marking
from factory.pipeline import Source
from factory.plant.factory import Factory
from factory.plant.fused_bodies import fusing_pays
from factory.simulation.request import RunRequest
from factory.simulation.run import Run
from factory.simulation.simulation import Observer, Simulation
from factory.support.console import say, table
from factory.support.errors import Diagnostic, InputError
from factory.support.interruption import Interruption
from factory.support.settings import Settings

if TYPE_CHECKING:
    from factory.record.monitor import Report
    from factory.render import Picture

Size = tuple[int, int]

SIZE = 1280, 720


def simulation(
    source: Source,
    layout: Layout,
    settings: Settings,
    options: dict[str, Any],
    shown: bool = True,
) -> Simulation:
    """The simulation that the options of the command line ask for; whether it is to be `shown`.
    Raises InputError."""
    start, fuse = options.get("start"), options.get("fuse")
    net = layout.factory.net
    request = RunRequest(
        options.get("world", "mujoco"),
        options.get("units", 1),
        options.get("seed", 0),
        options.get("jitter", 0.0),
        settings,
        None if start is None else legal_marking(net, start),
        options.get("wip"),
        bool(options.get("distributed")),
        fusing_pays(layout.factory, layout.product) if fuse is None else fuse,
        shown,
        catalogue=source.catalogue,
    )
    return Simulation(layout, request)


def run_file(
    source: Source,
    layout: Layout,
    settings: Settings,
    video: Path | None,
    log: Path | None,
    size: Size | None,
    quiet: bool,
    options: dict[str, Any],
) -> Run:
    """One run, filmed, logged and watched by a monitor as asked. Raises MissingError where a film
    needs GL that is not there, before anything is written."""
    from factory.nets.verify import proved
    from factory.support.progress import Progress

    proved(layout.factory.net)
    shown: Shown | None = None
    if options.get("world") == "ideal":
        check_ideal(options)
    if video is not None:
        if options.get("world") == "ideal":
            message = "the ideal world has no bodies to film"
            raise InputError(Diagnostic("Usage", message, None, "leave out --world ideal"))
        from factory.render import check_output
        from factory.support.gl import probe

        check_output(video, size or SIZE, options["fps"])
        shown = Shown.of(options, size or SIZE, [part.label for part in layout.factory.leaves])
        probe()
    elif options.get("poster") is not None:
        message = "--poster is of a film, and there is none"
        raise InputError(Diagnostic("Usage", message, None, "give --video OUT.mp4 as well"))
    seen = video is not None or log is not None or bool(options.get("monitor"))
    made = simulation(source, layout, settings, options, seen)
    with ExitStack() as stack:
        glances = [stack.enter_context(Interruption()).observe]
        observers: list[Observer] = []
        watcher = None
        if options.get("monitor"):
            from factory.record.monitor import beside

            watcher = beside(made)
            observers.append(watcher.observe)
        if log is not None:
            from factory.record.log import LogWriter

            observers.append(stack.enter_context(LogWriter(log, made, source, sys.argv)).observe)
        if video is not None:
            from factory.render import Film

            assert shown is not None
            film = Film(made, video, shown.picture, options["fps"], shown.poster)
            observers.append(stack.enter_context(film).observe)
        glances.append(stack.enter_context(Progress(made.request.units, quiet)).observe)
        record = made.run(observers, options.get("max_time"), glances)
    if watcher is None:
        return record
    report = watcher.report()
    return replace(record, monitor=report, refines_net=record.refines_net and report.refines_net)


def check_ideal(options: dict[str, Any]) -> None:
    """Raises InputError (Usage) for options that the ideal world has no bodies for."""
    for key, purpose in (
        ("monitor", "for a monitor to observe"),
        ("fuse", "that could become one"),
    ):
        if options.get(key):
            message = f"the ideal world has no bodies {purpose}"
            raise InputError(Diagnostic("Usage", message, None, "leave out --world ideal"))


def render_file(
    file: Path,
    output: Path,
    at: str,
    size: Size,
    quiet: bool,
    options: dict[str, Any],
    prepare: Callable[[], Simulation],
) -> dict[str, Any]:
    """A film, or a still (.png), of a log or of the simulation that `prepare` makes of a PAG; the
    keys of `render`.

    Raises InputError for what cannot be filmed, MissingError where there is no GL; nothing is
    written then. A run that stalls is filmed as far as it goes.
    """
    from factory.record.log import is_log, read_log
    from factory.render import Film, Still, check_output, render_log
    from factory.support.gl import probe
    from factory.support.progress import Progress

    moment = _moment(at)
    is_still = check_output(output, size, options["fps"], still=None)
    shown = Shown.of(options, size)
    if is_still and shown.poster is not None:
        message = "--poster is of a film; this is a still"
        raise InputError(Diagnostic("Usage", message, None, "leave out --poster"))
    probe()
    if is_log(file):
        log = read_log(file)
        frames = render_log(log, output, shown.picture, options["fps"], moment, shown.poster)
        return _picture(output, frames, size, options["fps"], is_still)
    made = prepare()
    with ExitStack() as stack:
        picture: Any = (
            Still(made, output, shown.picture, moment)
            if is_still
            else Film(made, output, shown.picture, options["fps"], shown.poster)
        )
        observers = [
            stack.enter_context(Interruption()).observe,
            stack.enter_context(picture).observe,
            stack.enter_context(Progress(made.request.units, quiet)).observe,
        ]
        enough = moment if is_still and moment != "end" else options.get("max_time")
        made.run(observers, enough)
    return _picture(output, 1 if is_still else picture.frames, size, options["fps"], is_still)


@dataclass(frozen=True, slots=True)
class Shown:
    """What a film or a still shows, as the command line asks for it, and where a `poster` goes."""

    picture: Picture
    poster: Path | None = None

    @classmethod
    def of(cls, options: dict[str, Any], size: Size, parts: list[str] | None = None) -> Shown:
        """Raises InputError (BadValue) for names that don't exist, or a size with no room."""
        from factory.render import Picture, camera_named, check_output, panels_named
        from factory.render.picture import shared

        camera, panels = camera_named(options["camera"], parts), panels_named(options["panels"])
        shared(size, panels)
        if options["poster"] is not None:
            check_output(options["poster"], size, still=True)
        picture = Picture(size, camera, panels=panels, title=options["title"])
        return cls(picture, options["poster"])


def _moment(at: str) -> float | Literal["end"]:
    """The time of a still [s], or the end."""
    if at == "end":
        return "end"
    try:
        seconds = float(at)
        if not 0 <= seconds < float("inf"):
            raise ValueError
    except ValueError:
        message = f"--at takes seconds or `end`, not '{at}'"
        raise InputError(Diagnostic("BadValue", message, None, "for example --at 2.5")) from None
    return seconds


def _picture(output: Path, frames: int, size: Size, fps: int, is_still: bool) -> dict[str, Any]:
    """The keys of `render --json`."""
    return {
        "output": str(output),
        "frames": frames,
        "width": size[0],
        "height": size[1],
        "fps": fps,
        "seconds": 0.0 if is_still else round(frames / fps, 6),
    }


def summarise(record: Run, factory: Factory, verbose: bool) -> None:
    """A run in a few lines for people."""
    cycle = f"{record.cycle_time_s:.3f} s" if record.cycle_time_s is not None else "not yet steady"
    say(
        f"{record.products} of {record.units} products in {record.sim_time_s:.2f} s "
        f"({record.realtime_factor:.1f} times real time, {record.world})"
    )
    say(
        f"cycle time {cycle}, predicted {record.predicted_cycle_time_s:.3f} s; "
        f"bottleneck {record.bottleneck}"
    )
    say(
        f"{len(record.events)} transitions fired, "
        f"the record {'refines' if record.refines_net else 'DOES NOT REFINE'} the net"
    )
    physics = record.physics
    if physics is not None:
        chosen = physics.timestep_chosen
        how = "chosen for what it carries (--timestep)" if chosen else "as asked for"
        say(f"timestep {1000 * physics.timestep_s:g} ms, {how}")
        error = physics.product_error_max_mm
        say(
            f"{physics.handoffs} hand-offs, gap at most {physics.handoff_gap_max_mm:.3f} mm; "
            f"product error {'none measured' if error is None else f'{error:.3f} mm'}; "
            f"{physics.unintended_contacts} unintended contacts, "
            f"{physics.engine_warnings} engine warnings"
        )
        for pair in physics.contacts[:8]:
            say(f"  touched: {pair}")
        if physics.mating_forces:
            most = max(physics.mating_forces, key=physics.mating_forces.__getitem__)
            say(f"inputs pressed on each other with {physics.mating_force_max_n:.3f} N in {most}")
        if physics.excluded:
            say(f"{len(physics.excluded)} pairs that clash when joined pass through each other")
        for one, other in physics.excluded if verbose else ():
            say(f"  left out: {one} - {other}")
        if physics.fused:
            say("parts joined for good are one rigid body (--no-fuse keeps them apart)")
    if record.monitor is not None:
        say(verdict(record.monitor))
    busy = sorted(zip(factory.robots, record.utilisation, strict=True), key=lambda p: -p[1])
    rows = [(r.name, r.type, f"{100 * u:.0f} %") for r, u in (busy if verbose else busy[:6])]
    table("Utilisation", ("robot", "type", "busy"), rows)


def verdict(report: Report) -> str:
    """What a monitor found, in a line for people."""
    counts = f"{len(report.seen)} firings seen, {len(report.inferred)} inferred"
    if report.refines_net:
        return f"monitor: {counts}; they explain the run"
    return f"monitor: {counts}; {len(report.violations)} VIOLATIONS"


def say_violations(report: Report | None, shown: int = 8) -> None:
    """The first violations, on stderr."""
    for violation in report.violations[:shown] if report else ():
        print(violation.diagnostic(), file=sys.stderr)
