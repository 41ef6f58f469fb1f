"""The command `check`: what a PAG compiles to and what is proved of it, or of a net in PNML."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factory.commands.options import OUTPUT, PATH, RELAY, SOURCE, WIP, for_a_pag
from factory.commands.outputs import writable, writable_folder
from factory.commands.requests import OutputOptions, ProjectOptions
from factory.support.collector import collector_paused
from factory.support.console import emit, say, table, warn
from factory.support.files import is_net

if TYPE_CHECKING:
    from factory.compiler.mating.mating import Mating, Matings
    from factory.geometry.solids import Product
    from factory.nets.gears import Gear, GearNet
    from factory.nets.marked import MarkedNet
    from factory.nets.petri import Place
    from factory.nets.verdict import Verdict
    from factory.pipeline import Project

SHOWN = 24
"""The most robots, and blocked operations, that are printed, unless `-v` asks for all."""

NAMED = 3
"""The most pairs of parts that are named in a line."""

POOLED = 8
"""The most parts whose copies are printed."""


@click.command()
@SOURCE
@click.option("--certificate", type=PATH, help="Write the proof here.")
@WIP
@click.option("--clashes", type=PATH, help="Write a picture of each blocked operation in a folder.")
@RELAY
@OUTPUT
@collector_paused()
def check(
    given: ProjectOptions,
    out: OutputOptions,
    certificate: Path | None,
    wip: int | None,
    clashes: Path | None,
) -> int:
    """Parse, compile and prove FILE.pag (or a net in FILE.pnml)."""
    from factory.support.files import own_names, write_all, write_text

    file = given.file
    if is_net(file):
        for_a_pag(file, "a net in PNML", "certificate")
    writable(file, certificate)
    writable_folder(clashes)
    checked = _check_net(file) if is_net(file) else _check_project(given, wip)
    warnings = checked.product.warnings if checked.product else ()
    warn(warnings, out.quiet)
    if clashes is not None:
        files = checked.pictures(clashes)
        own_names(clashes, files, [file])
        write_all(files)
    if certificate is not None:
        write_text(certificate, checked.certificate())
    if out.as_json:
        emit({**checked.as_json(), "warnings": [d.as_json() for d in warnings]})
    elif not out.quiet:
        _describe(checked, out.verbose)
    return 0 if checked.verdict.holds else 1


@dataclass(frozen=True)
class Checked:
    """A net with its verdict, of a PAG called `name` or read from PNML. `pool`: copies of each part
    that are inside at once; `matings`: how its inputs come together, None where no part has a shape
    of its own; `product`: None where every part is a default box."""

    name: str
    net: GearNet | MarkedNet
    verdict: Verdict
    labels: int = 0
    pool: Mapping[str, int] = field(default_factory=dict)
    matings: Matings | None = None
    product: Product | None = None

    def certificate(self) -> str:
        """The proof as a document that another program can check."""
        from factory.export.certificate.writer import certificate

        return json.dumps(certificate(self.net, self.verdict), ensure_ascii=False) + "\n"

    def pictures(self, folder: Path) -> dict[Path, bytes]:
        """The files that `check --clashes` writes, one for each blocked operation."""
        from factory.export.clash_picture import pictures

        if self.matings is None or self.product is None:
            return {}
        return pictures(folder, self.matings, self.product)

    def as_json(self) -> dict[str, Any]:
        """The keys of `check --json`."""
        from factory.nets.marked import marked

        subject = marked(self.net)
        places = subject.net.places
        blocked = self.matings.of_kind("blocked") if self.matings else ()
        return {
            "product": self.name,
            "labels": self.labels,
            "robots": len(self.verdict.gears),
            "places": len(places),
            "transitions": len(subject.net.transitions),
            "tokens": sum(subject.tokens),
            "largest_mode": max((p.size for p in places), default=0),
            **self.verdict.as_json(),
            "gears": [_gear_json(gear, places) for gear in self.verdict.gears],
            "part_pool": dict(self.pool),
            "approaches": self.matings.as_json() if self.matings else None,
            "clashes": [clash for mating in blocked for clash in mating.clashes_as_json()],
        }


def _gear_json(gear: Gear, places: Sequence[Place]) -> dict[str, Any]:
    """One robot's gear as `check --json` lists it."""
    return {
        "robot": gear.robot,
        "type": gear.type,
        "places": [
            {"name": places[p].name, "mode": places[p].mode, "label": places[p].label}
            for p in gear.places
        ],
    }


def project_of(given: ProjectOptions) -> Project:
    """The project of a command without options of motion: settings matter to relays alone, whose
    number depends on the layout. Raises InputError."""
    from factory.pipeline import read

    return given.project() if given.ground().relays else read(given.file, given.folders)


def _check_project(given: ProjectOptions, wip: int | None) -> Checked:
    """Check a PAG. Raises InputError."""
    from factory.geometry.limits import is_plain
    from factory.nets.verify import verify
    from factory.timing.pool import part_pool

    project = project_of(given)
    factory = project.factory
    sources = {r.name: r.position for r in factory.robots if r.position}
    return Checked(
        project.pag.root,
        factory.net,
        verify(factory.net, sources),
        len(factory.pag),
        part_pool(factory, wip),
        project.matings,
        None if is_plain(project.pag) else project.product,
    )


def _check_net(file: Path) -> Checked:
    """Check a net from elsewhere; it may well fail. Raises InputError."""
    from factory.foreign_nets.general import analyse
    from factory.foreign_nets.pnml_reader import load_net

    net = load_net(file)
    return Checked(file.stem, net, analyse(net))


def _describe(checked: Checked, verbose: bool) -> None:
    """A summary for people: the gears, the counts and the verdict."""
    document = checked.as_json()
    gears = document["gears"]
    shown = gears if verbose else gears[:SHOWN]
    rows = (
        (
            g["robot"],
            g["type"],
            " · ".join(f"{p['mode']} {p['label']}".strip() for p in g["places"]),
        )
        for g in shown
    )
    table("", ("robot", "type", "gear"), rows)
    if len(shown) < len(gears):
        say(f"... and {len(gears) - len(shown)} more robots (-v shows all)")
    say(
        f"{checked.name}: {document['robots']} robots, {document['places']} places,"
        f" {document['transitions']} transitions, {document['tokens']} tokens,"
        f" largest mode {document['largest_mode']}"
    )
    words = {True: "yes", False: "NO", None: "undecided"}
    names = ("gear_net", "live", "safe", "reversible", "legal")
    say(", ".join(f"{name.replace('_', ' ')}: {words[document[name]]}" for name in names))
    for witness in checked.verdict.witness:
        say(f"  {witness}")
    if checked.pool:
        most = sorted(checked.pool.items(), key=lambda item: -item[1])[:POOLED]
        listed = ", ".join(f"{label} {count}" for label, count in most)
        say(f"copies inside at once: {listed}{', ...' if len(checked.pool) > POOLED else ''}")
    if checked.matings is not None:
        _describe_approaches(checked.matings, None if verbose else SHOWN)


def _describe_approaches(matings: Matings, most: int | None) -> None:
    """For people: the figures in a line, and a line for each blocked operation, at most so many."""
    strict, no_deeper, left_out = (matings.count(level) for level in (3, 2, 1))
    lowered, blocked = len(matings.of_kind("lower")), matings.of_kind("blocked")
    say(
        f"approach: {left_out} of {len(matings.all)} operations clean with finished overlaps left"
        f" out, {no_deeper} with paths no deeper, {strict} strictly; {lowered} lowered,"
        f" {len(blocked)} blocked"
    )
    for mating in blocked[:most]:
        say(f"  {_blocked_line(mating)}")
    if most is not None and len(blocked) > most:
        say(f"  ... and {len(blocked) - most} more (-v shows all)")
    if blocked:
        say("  --clashes DIR draws each of them")


def _blocked_line(mating: Mating) -> str:
    """Where, what is blocked and by what."""
    named = [
        f"{c.parts[0]} and {c.parts[1]} {c.depth * 1e3:.2f} mm" for c in mating.clashes[:NAMED]
    ]
    more = len(mating.clashes) - len(named)
    pairs = ", ".join(named) + (f", and {more} more" if more else "")
    where = f"{mating.position}: " if mating.position else ""
    return f"{where}Blocked warning: {mating.inputs[-1]} cannot come to {mating.label}: {pairs}"
