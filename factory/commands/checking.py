"""Check of a PAG or of a net in PNML: the compiled net and what is proved of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from factory.apps.few_robots.aim import Least, least_of
from factory.engine.timing.pool import part_pool
from factory.pipeline import Project
from factory.support.errors import Diagnostic
from factory.theory.nets.gears import Gear, GearNet
from factory.theory.nets.marked import MarkedNet
from factory.theory.nets.petri import Place
from factory.theory.nets.verdict import Verdict
from factory.theory.nets.verify import verify
from factory.theory.plant.factory import Factory

if TYPE_CHECKING:
    from factory.floor.geometry.solids import Product
    from factory.floor.layout.hands.misses import NoGrip
    from factory.floor.mating.findings import Matings
    from factory.theory.nets.coordinated import CoordinatedNet


@dataclass(frozen=True)
class Checked:
    """A net with its verdict, of a PAG called `name` or read from PNML. `pool`: number of copies of
    each part inside at once; `matings`: how inputs come together, None if no part has its own
    shape; `product`: None if every part is a default box; `no_grips`: what no hand can hold, None
    for a net from PNML; `factory` and the `least` number of robots for its product, None for a
    net from PNML; the `coordinated` net with what else moves, None if not requested;
    the number of robots for each product of a mix `alone`; what `machines` the net is coordinated
    with, in words."""

    name: str
    net: GearNet | MarkedNet
    verdict: Verdict
    labels: int = 0
    pool: Mapping[str, int] = field(default_factory=dict)
    matings: Matings | None = None
    product: Product | None = None
    warnings: tuple[Diagnostic, ...] = ()
    no_grips: tuple[NoGrip, ...] | None = None
    factory: Factory | None = None
    least: Least | None = None
    coordinated: CoordinatedNet | None = None
    alone: tuple[int, ...] = ()
    machines: str = ""

    def counts(self) -> dict[str, int]:
        """The numbers of robots, places, transitions and tokens, and the size of the largest
        mode."""
        subject = MarkedNet.of(self.net)
        return {
            "robots": len(self.verdict.gears),
            "places": len(subject.net.places),
            "transitions": len(subject.net.transitions),
            "tokens": sum(subject.tokens),
            "largest_mode": max((place.size for place in subject.net.places), default=0),
        }

    def gears(self, most: int | None = None) -> Iterator[dict[str, Any]]:
        """The gears as `check --json` lists them: all, or `most` of them."""
        places = MarkedNet.of(self.net).net.places
        return (_gear_json(gear, places) for gear in self.verdict.gears[:most])

    def as_json(self) -> dict[str, Any]:
        """The keys of `check --json`, for `emit`."""
        blocked = self.matings.of_kind("blocked") if self.matings else ()
        no_grips = None if self.no_grips is None else [miss.as_json() for miss in self.no_grips]
        return {
            "product": self.name,
            "labels": self.labels,
            **self.counts(),
            **self.verdict.as_json(),
            "gears": self.gears(),
            "part_pool": dict(self.pool),
            "approaches": self.matings.as_json() if self.matings else None,
            "clashes": [mating.clashes_as_json() for mating in blocked],
            **({} if no_grips is None else {"no_grips": no_grips}),
            **self._overlaps(),
            **self._allocation(),
            **({"coordinated": self.coordinated.as_json()} if self.coordinated else {}),
            "warnings": [warning.as_json() for warning in self.warnings],
        }

    def _overlaps(self) -> dict[str, Any]:
        """The parts that overlap in the finished product, by how much, and the allowed depth
        [mm]."""
        if self.product is None or self.factory is None:
            return {}
        from factory.floor.geometry.overlapping import overlaps_of

        pag = self.factory.pag
        insides = pag.insides if pag.mix else ()
        rows = [
            {
                "parts": [pair.one, pair.other],
                "depth_mm": round(1e3 * pair.depth, 6),
                "allowed_mm": round(1e3 * pag.most_allowed(pair.one, pair.other), 6),
            }
            for pair in overlaps_of(self.product, *insides).pairs
        ]
        return {"overlaps": rows}

    def _allocation(self) -> dict[str, Any]:
        """The robots that serve several labels, the least number of robots, and a live order."""
        if self.factory is None:
            return {}
        factory = self.factory
        several = [r for r, tours in zip(factory.robots, factory.tours, strict=True) if tours[1:]]
        lines = [(robot.name, factory.deliveries(robot.index)) for robot in several]
        return {
            **({"least_robots": self.least.total} if self.least else self._mix(factory)),
            "lines": [{"robot": n, "labels": list(x)} for n, x in lines if len(x) > 1],
            "order": [factory.operations[number].label for number in factory.order],
        }

    def _mix(self, factory: Factory) -> dict[str, Any]:
        """The products of a mix with the robots that each needs alone, their sequence in a period,
        and the labels that are common to all."""
        pag = factory.pag
        counts = dict(pag.mix.counts if pag.mix else ())
        alone = zip(pag.products, self.alone, strict=True)
        inside = ({node.label for node in pag.product(x).nodes} for x in pag.products)
        common = set.intersection(*inside)
        return {
            "products": [
                {"label": label, "count": counts[label], "robots_alone": robots}
                for label, robots in alone
            ],
            "period": factory.period,
            "sequence": list(factory.sequence),
            "common": [label for label in pag.by_label if label in common],
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


def check_project(project: Project, wip: int | None = None, laid_out: bool = False) -> Checked:
    """Check a PAG, with at most `wip` units inside at once. `laid_out`: include the coordinated
    net, which needs a layout; it is included where only a layout tells whether the product can be
    made. Raises InputError; RunError (Layout, Unreachable, NoWay) where there is no layout."""
    factory = project.factory
    sources = {r.name: r.position for r in factory.robots if r.position}
    verdict = verify(factory.net, sources)
    return Checked(
        project.pag.root,
        factory.net,
        verdict,
        len(factory.pag),
        part_pool(factory, wip),
        project.matings,
        None if project.pag.is_plain else project.product,
        project.warnings,
        project.no_grips,
        factory,
        None if project.pag.mix else least_of(project.compiled, project.templates),
        _coordinated(project) if laid_out or project.ground.reach_bound else None,
        tuple(len(one.compiled.robots) for one in project.each),
        project.ground.machines,
    )


def _coordinated(project: Project) -> CoordinatedNet:
    from factory.floor.layout.exclusions import coordinated

    return coordinated(project.layout)


def check_net(file: Path) -> Checked:
    """Check a net in PNML, which need not be that of a factory. Raises InputError."""
    from factory.apps.foreign_nets.behaviour import analyse
    from factory.apps.foreign_nets.pnml_reader import load_net

    net = load_net(file)
    return Checked(file.stem, net, analyse(net))
