"""The command `plant`."""

from __future__ import annotations

import sys

import click

from factory.apps.runs.options import RunOptions
from factory.commands.defaults import with_defaults
from factory.commands.grouped import Grouped
from factory.commands.options import FLOOR, LENIENT, MOTION, OUTPUT, RUN, SOURCE, address
from factory.commands.requests import OutputOptions, ProjectOptions
from factory.commands.summaries import summarise, tell_failures
from factory.commands.warnings import announced
from factory.support.console import emit, say
from factory.support.errors import usage_error

SCAN = 10
"""Default period at which the plant reads its commands [ms]."""


@with_defaults
@click.command(cls=Grouped)
@SOURCE
@RUN
@address(4840)
@click.option(
    "--scan",
    type=click.IntRange(1, 1000),
    default=SCAN,
    help="Period at which the plant reads its commands [ms].",
)
@click.option(
    "--pace",
    type=click.FloatRange(0.01, 100.0),
    default=1.0,
    help="Simulated seconds per second of real time.",
)
@LENIENT
@FLOOR
@MOTION
@OUTPUT
def plant(
    options: ProjectOptions,
    asked: RunOptions,
    out: OutputOptions,
    port: int,
    host: str,
    expose: bool,
    scan: int,
    pace: float,
) -> int:
    """Serve the plant of FILE.pag to a PLC, by OPC UA.

    It ends when its products are made. The controller writes targets, grips, jobs and a heartbeat,
    without which all axes stand. What the net or the reach of a grip does not allow is refused by
    name. `export --format st` writes a controller."""
    from factory.api import Simulation, proved
    from factory.apps.plc.opcua import OpcuaPlant, check_plant
    from factory.apps.runs.running import carry_on

    check_plant(host, expose)
    if asked.start is not None:
        message = "a plant starts where every robot waits with no part"
        raise usage_error(message, "leave out --from")
    asked.check_combination()
    project = options.project(out.silent)
    layout = project.layout
    proved(layout.factory.net)
    warnings = announced(project.warnings, out)
    made = Simulation(layout, asked.request(project))
    with OpcuaPlant(made, scan / 1000, host, port, expose, pace) as server:
        if out.as_json:
            emit({"address": server.address, "warnings": warnings})
        else:
            say(f"{server.address}  (Ctrl-C to stop)")
        sys.stdout.flush()
        if expose:
            reach = f"anyone who can reach {host} can drive this factory's robots"
            print(f"warning: {reach}; the connection is not encrypted", file=sys.stderr)
        record = carry_on(made, asked, True, None, [], True)
    if not out.as_json:
        summarise(record, layout.factory, out.verbose)
    tell_failures(record.verdict, out.verbose)
    return 0 if record.succeeded else 1
