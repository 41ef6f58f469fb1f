"""The command `view`."""

from __future__ import annotations

import shlex
import sys
from dataclasses import replace
from typing import TYPE_CHECKING

import click

from factory.commands.grouped import Grouped
from factory.commands.options import DRAW, FAULTS, FLOOR, MOTION, OUTPUT, RELAY, RUNS, SOURCE, WIP
from factory.commands.requests import OutputOptions, ProjectOptions, RunOptions
from factory.commands.warnings import announced
from factory.support.console import emit, say

if TYPE_CHECKING:
    from factory.show.live import Server

FOR_EVER = 10**9
"""Units of a run that does not end by itself."""


@click.command(cls=Grouped)
@SOURCE
@FAULTS
@click.option("--port", type=click.IntRange(0, 65535), default=8765, help="0: a free one.")
@click.option("--host", default="127.0.0.1", help="Listen here; only this machine can come.")
@click.option("--expose", is_flag=True, help="Let HOST be one that other machines can reach.")
@click.option("--paused", is_flag=True, help="Do not run before Play is pressed.")
@DRAW
@WIP
@RUNS
@FLOOR
@RELAY
@MOTION
@OUTPUT
def view(
    given: ProjectOptions,
    asked: RunOptions,
    out: OutputOptions,
    port: int,
    host: str,
    expose: bool,
    paused: bool,
) -> int:
    """Run FILE.pag for ever and show it in a browser: pause it, push robots, block feeders.

    With --spares, --deputies or --faults it goes on after failures: let robots drop things and die,
    and parts be no good."""
    from factory.nets.verify import proved
    from factory.show.live import Server, Session
    from factory.show.live.page import page
    from factory.show.live.server import check_server
    from factory.simulation.simulation import Simulation
    from factory.support.interruption import Interruption

    check_server(host, expose)
    project = given.project(out.silent)
    layout = project.layout
    proved(layout.factory.net)
    warnings = announced(layout.product.warnings, out)
    fails = asked.recovers or given.deputies
    endless = replace(asked, units=FOR_EVER, fuse=False).request(project)
    request = replace(endless, recovers=fails)
    campaign = asked.campaign(layout.factory) if fails else None
    session = Session(lambda: Simulation(layout, request), not paused, campaign)
    shown = page(session, shlex.join(["factory", *sys.argv[1:]]))
    with Interruption() as stop, Server(session, shown, host, port, expose) as server:
        if out.as_json:
            where = {"address": server.address, "host": host, "port": server.port}
            emit({**where, "warnings": warnings})
        else:
            _tell(server, host, expose)
        sys.stdout.flush()
        session.run(stop.observe)
    return 0


def _tell(server: Server, host: str, expose: bool) -> None:
    """The address; printed with --quiet too, since it cannot be guessed."""
    say(f"{server.address}  (Ctrl-C ends it)")
    if not expose:
        there = f"ssh -L {server.port}:127.0.0.1:{server.port} THIS-MACHINE"
        say(f"from elsewhere: {there}, then the same address there")
        return
    print(
        f"warning: everyone that reaches {host} and knows this address can push this factory's "
        "robots; nothing is encrypted",
        file=sys.stderr,
    )
