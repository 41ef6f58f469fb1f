"""The command `programs`."""

from __future__ import annotations

import click

from factory.commands.defaults import with_defaults
from factory.commands.options import OUTPUT, RELAY, SOURCE
from factory.commands.requests import OutputOptions, ProjectOptions
from factory.support.console import emit, say
from factory.support.errors import did_you_mean, usage_error


@with_defaults
@click.command()
@SOURCE
@click.option("--robot", help="Only this robot, for example r3.")
@RELAY
@OUTPUT
def programs(options: ProjectOptions, out: OutputOptions, robot: str | None) -> int:
    """Print each robot's program, in the paper's form."""
    from factory.apps.exports.program_text import write_program
    from factory.theory.plant.programs import Program

    factory = options.project(out.silent).factory
    names = [r.name for r in factory.robots]
    if robot is not None and robot not in names:
        hint = did_you_mean(robot, names, "robots")
        raise usage_error(f"there is no robot '{robot}'", hint)
    chosen = [r for r in factory.robots if robot in (None, r.name)]
    texts = {r.name: write_program(Program.of(factory, r.index)) for r in chosen}
    if out.as_json:
        emit({"programs": texts})
    else:
        say("\n\n".join(texts.values()))
    return 0
