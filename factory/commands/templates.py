"""The command `templates`."""

from __future__ import annotations

from pathlib import Path

import click

from factory.commands.options import OUTPUT, TEMPLATES
from factory.commands.requests import OutputOptions
from factory.support.console import emit, say, table


@click.command()
@TEMPLATES
@OUTPUT
def templates(folders: tuple[Path, ...], out: OutputOptions) -> int:
    """List the available operations and robot types."""
    from factory.floor.robots.catalogue import load_catalogue
    from factory.theory.lang.template_reader import all_templates
    from factory.theory.lang.writer import write_template

    operations, catalogue = all_templates(folders), load_catalogue()
    if out.as_json:
        emit(
            {
                "templates": [
                    {
                        "name": t.name,
                        "robots": list(t.robots),
                        "carrier": t.carrier,
                        "inputs": len(t.inputs),
                        "further": t.further or None,
                        "instead": t.instead or None,
                        "failures": [failure.as_json() for failure in t.failures],
                        "parameters": dict(t.parameters),
                        "geometry": t.geometry,
                        "text": write_template(t),
                    }
                    for t in operations.values()
                ],
                "robots": [
                    {"name": r.name, "extends": r.extends or None, "summary": r.summary}
                    for r in catalogue.types.values()
                ],
            }
        )
        return 0
    rows = (
        (
            t.name,
            f"< {', '.join(t.robots)} >",
            f"{len(t.inputs)}{'+' if t.further else ''}",
            ", ".join(f"{k} = {v}" for k, v in t.parameters) or ("geometry" if t.geometry else ""),
        )
        for t in operations.values()
    )
    table("Operations", ("name", "robots", "inputs", "parameters"), rows)
    table(
        "Robot types",
        ("name", "extends", "what it is"),
        ((r.name, r.extends, r.summary) for r in catalogue.types.values()),
    )
    if out.verbose:
        for template in operations.values():
            say(write_template(template))
    return 0
