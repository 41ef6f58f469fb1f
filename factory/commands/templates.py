"""The commands `templates` and `doctor`."""

from __future__ import annotations

from pathlib import Path

import click

from factory.commands.options import OUTPUT, PATH
from factory.support.console import emit, say, table


@click.command()
@click.option(
    "--templates", "folders", multiple=True, type=PATH, help="A folder of further operations."
)
@OUTPUT
def templates(folders: tuple[Path, ...], as_json: bool, quiet: bool, verbose: bool) -> int:
    """List the operations and robot types there are."""
    from factory.lang.writer import write_template
    from factory.pipeline import all_templates
    from factory.problem.robot_types import load_catalogue

    found, catalogue = all_templates(folders), load_catalogue()
    if as_json:
        emit(
            {
                "templates": [
                    {
                        "name": t.name,
                        "robots": list(t.robots),
                        "carrier": t.carrier,
                        "inputs": len(t.inputs),
                        "further": t.further or None,
                        "parameters": dict(t.parameters),
                        "geometry": t.geometry,
                        "text": write_template(t),
                    }
                    for t in found.values()
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
        for t in found.values()
    )
    table("Operations", ("name", "robots", "inputs", "parameters"), rows)
    table(
        "Robot types",
        ("name", "extends", "what it is"),
        ((r.name, r.extends, r.summary) for r in catalogue.types.values()),
    )
    if verbose:
        for template in found.values():
            say(write_template(template))
    return 0


@click.command()
@OUTPUT
def doctor(as_json: bool, quiet: bool, verbose: bool) -> int:
    """Say what works on this machine, and what would mend the rest."""
    from factory.commands.doctor import examine

    findings = examine()
    good = all(f.ok for f in findings)
    if as_json:
        emit(
            {
                "ok": good,
                "checks": [
                    {"name": f.name, "ok": f.ok, "found": f.found, "mend": f.mend} for f in findings
                ],
            }
        )
    else:
        for finding in findings:
            say(f"{'ok     ' if finding.ok else 'MISSING'} {finding.name}: {finding.found}")
            if not finding.ok:
                say(f"        {finding.mend}")
    return 0 if good else 3
