"""The command `view`."""

from __future__ import annotations

import shlex
import sys
from dataclasses import replace
from typing import TYPE_CHECKING

import click

from factory.apps.runs.options import RunOptions
from factory.commands import options as shared
from factory.commands.defaults import with_defaults
from factory.commands.grouped import Grouped
from factory.commands.requests import OutputOptions, ProjectOptions
from factory.commands.warnings import announced
from factory.support.console import emit, say

if TYPE_CHECKING:
    from factory.apps.live import Server

FOR_EVER = 10**9
"""Units of a run that does not end by itself."""


@with_defaults
@click.command(cls=Grouped)
@shared.SOURCE
@shared.FAULTS
@shared.address(8765)
@click.option("--paused", is_flag=True, help="Wait until Play is pressed.")
@shared.DRAW
@shared.WIP
@shared.RUNS
@shared.FLOOR
@shared.RELAY
@shared.MOTION
@shared.OUTPUT
def view(
    options: ProjectOptions,
    asked: RunOptions,
    out: OutputOptions,
    port: int,
    host: str,
    expose: bool,
    paused: bool,
) -> int:
    """Run FILE.pag endlessly, and show it in a browser.

    There you can pause it, push robots and block feeders. With --spares or --faults the run
    recovers from failures: you can pause or kill robots."""
    from factory.api import Simulation, proved
    from factory.apps.live import Server, Session
    from factory.apps.live.page import page
    from factory.apps.live.server import check_server
    from factory.apps.runs.running import campaign_of, check_run
    from factory.support.interruption import Interruption

    check_server(host, expose)
    project = options.project(out.silent)
    check_run(project, asked)
    layout = project.layout
    proved(layout.factory.net)
    warnings = announced(layout.product.warnings, out)
    apart = None if layout.factory.takes_wholes else False
    request = replace(asked, units=FOR_EVER, fuse=apart).request(project)
    campaign = campaign_of(asked, layout.factory) if asked.recovers else None
    session = Session(lambda: Simulation(layout, request), not paused, campaign)
    shown = page(session, shlex.join(["factory", *sys.argv[1:]]))
    with Interruption() as stop, Server(session, shown, host, port, expose) as server:
        if out.as_json:
            where = {"address": server.address, "host": host, "port": server.port}
            emit({**where, "warnings": warnings})
        else:
            _print(server, host, expose)
        sys.stdout.flush()
        session.run(stop.observe)
    return 0


def _print(server: Server, host: str, expose: bool) -> None:
    """The address; printed with --quiet too, since it cannot be guessed."""
    say(f"{server.address}  (Ctrl-C to stop)")
    if not expose:
        there = f"ssh -L {server.port}:127.0.0.1:{server.port} THIS-MACHINE"
        say(f"from another machine: {there}, then open the same address there")
        return
    print(
        f"warning: anyone who can reach {host} and knows this address can push this factory's "
        "robots; the connection is not encrypted",
        file=sys.stderr,
    )
