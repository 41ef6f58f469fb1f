"""The command `check`: what a PAG compiles to and what is proved of it, or of a net in PNML."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from factory.commands.approaches import approaches_json, clashes_json, describe_approaches
from factory.nets.gears import Gear, GearNet
from factory.nets.marked import MarkedNet, marked
from factory.nets.petri import Place
from factory.nets.verdict import Verdict
from factory.plant.factory import Factory
from factory.support.console import say, table
from factory.support.files import is_net

if TYPE_CHECKING:
    from factory.compiler.mating.mating import Matings
    from factory.geometry.solids import Product
    from factory.support.errors import Diagnostic

SHOWN = 24
"""Robots in the table for people; `--json` and `-v` list all."""


@dataclass(frozen=True)
class Checked:
    """A net with its verdict; `factory` is None where the net was read from PNML. `matings`: how
    its inputs come together, None where no part has a shape of its own; `product`: None where none
    says more of itself than its colour."""

    name: str
    labels: int
    net: GearNet | MarkedNet
    verdict: Verdict
    factory: Factory | None
    pool: dict[str, int]
    matings: Matings | None = None
    product: Product | None = None

    def certificate(self) -> str:
        """The proof as a document that another program can check."""
        from factory.export.certificate.writer import certificate

        return json.dumps(certificate(self.net, self.verdict), ensure_ascii=False) + "\n"

    def as_json(self) -> dict[str, Any]:
        """The keys of `check --json`."""
        subject = marked(self.net)
        places = subject.net.places
        return {
            "product": self.name,
            "labels": self.labels,
            "robots": len(self.verdict.gears),
            "places": len(places),
            "transitions": len(subject.net.transitions),
            "tokens": sum(subject.tokens),
            "largest_mode": max((p.size for p in places), default=0),
            **self.verdict.as_json(),
            "gears": [gear_json(gear, places) for gear in self.verdict.gears],
            "part_pool": self.pool,
            "approaches": approaches_json(self.matings),
            "clashes": clashes_json(self.matings),
            "warnings": [d.as_json() for d in self.warnings],
        }

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """What there is to warn about in the product's geometry."""
        return self.product.warnings if self.product else ()

    def pictures(self, folder: Path) -> dict[Path, bytes]:
        """The files that `check --clashes` writes, one for each blocked operation."""
        if self.matings is None or self.product is None:
            return {}
        from factory.export.clash_picture import pictures

        return pictures(folder, self.matings, self.product)


def gear_json(gear: Gear, places: Sequence[Place]) -> dict[str, Any]:
    """One robot's gear as `check --json` lists it."""
    return {
        "robot": gear.robot,
        "type": gear.type,
        "places": [
            {"name": places[p].name, "mode": places[p].mode, "label": places[p].label}
            for p in gear.places
        ],
    }


def check_file(
    file: Path,
    folders: Sequence[Path],
    wip: int | None = None,
    relayed: Factory | None = None,
) -> Checked:
    """Check a PAG, or a net in PNML; `relayed`: what the PAG compiles to with relays, where these
    are wanted. Raises InputError."""
    if is_net(file):
        return check_net(file)
    from factory.geometry.limits import is_plain
    from factory.nets.verify import verify
    from factory.pipeline import read
    from factory.timing.pool import part_pool

    source = read(file, folders)
    factory = relayed or source.compile()
    sources = {r.name: r.position for r in factory.robots if r.position}
    verdict = verify(factory.net, sources)
    pool = dict(part_pool(factory, wip))
    product = None if is_plain(source.pag) else source.product
    return Checked(
        source.pag.root,
        len(factory.pag),
        factory.net,
        verdict,
        factory,
        pool,
        source.matings,
        product,
    )


def check_net(file: Path) -> Checked:
    """Check a net from elsewhere; it may well fail. Raises InputError."""
    from factory.foreign_nets.general import analyse
    from factory.foreign_nets.pnml_reader import read_pnml
    from factory.lang.source import read_text

    net = read_pnml(read_text(file), str(file))
    verdict = analyse(net)
    return Checked(file.stem, 0, net, verdict, None, {})


def describe(checked: Checked, verbose: bool) -> None:
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
        most = sorted(checked.pool.items(), key=lambda item: -item[1])[:8]
        listed = ", ".join(f"{label} {count}" for label, count in most)
        say(f"copies inside at once: {listed}{', ...' if len(checked.pool) > 8 else ''}")
    if checked.matings is not None:
        describe_approaches(checked.matings, None if verbose else SHOWN)
