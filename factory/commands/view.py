"""The command `view`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from factory.commands.options import (
    DRAW,
    FLOOR,
    MOTION,
    OUTPUT,
    RELAY,
    SOURCE,
    WIP,
    plan,
    settings_of,
)
from factory.support.console import emit, say, warn

FOR_EVER = 10**9
"""Units of a run that nobody has finished yet."""


@click.command()
@SOURCE
@click.option("--port", type=click.IntRange(0, 65535), default=8765, help="0: a free one.")
@click.option("--host", default="127.0.0.1", help="Listen here; only this machine can come.")
@click.option("--expose", is_flag=True, help="Let HOST be one that other machines can reach.")
@click.option("--paused", is_flag=True, help="Wait for somebody to press Play.")
@DRAW
@WIP
@FLOOR
@RELAY
@MOTION
@OUTPUT
def view(
    file: Path,
    folders: tuple[Path, ...],
    port: int,
    host: str,
    expose: bool,
    paused: bool,
    floor: str | None,
    as_json: bool,
    quiet: bool,
    verbose: bool,
    **options: Any,
) -> int:
    """Run FILE.pag for ever and show it in a browser: pause it, push robots, block feeders."""
    from factory.commands.run_factory import simulation
    from factory.nets.verify import proved
    from factory.show.live import Server, Session
    from factory.show.live.page import page
    from factory.show.live.server import check_server
    from factory.support.interruption import Interruption

    check_server(host, expose)
    settings = settings_of(file, options)
    source, factory, layout = plan(file, folders, settings, floor, options)
    proved(factory.net)
    warn(layout.product.warnings, quiet)
    options |= {"units": FOR_EVER, "fuse": False}
    session = Session(lambda: simulation(source, layout, settings, options), not paused)
    with Interruption() as stop, Server(session, page(session), host, port, expose) as server:
        if as_json:
            emit({"address": server.address, "host": host, "port": server.port})
        else:
            _tell(server, host, expose)
        sys.stdout.flush()
        session.run(stop.observe)
    return 0


def _tell(server: Any, host: str, expose: bool) -> None:
    """Where to look; also with --quiet, for it cannot be guessed."""
    say(f"{server.address}  (Ctrl-C ends it)")
    if not expose:
        there = f"ssh -L {server.port}:127.0.0.1:{server.port} THIS-MACHINE"
        say(f"from elsewhere: {there}, then the same address there")
        return
    print(
        f"warning: who can reach {host} and knows this address can push this factory's robots; "
        "nothing is encrypted",
        file=sys.stderr,
    )
