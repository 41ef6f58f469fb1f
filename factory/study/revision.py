"""The next revision of a product: what stays of its factory, and the layout that keeps most of it.

A robot that stays keeps its name. Grades of what stays, each for itself: the *program*, but for
names of labels; the *contents*, all that it ever holds; the *module*, its hand, length, offset and
arm; the *place* in the world.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import count, islice
from typing import Any, Literal

from factory.compiler.mating.mating import judged
from factory.layout.dimensions import Clearance
from factory.layout.durations import Pace
from factory.layout.embedding import certified
from factory.layout.hands.choosing import Hands
from factory.layout.inheriting import Inheritance
from factory.layout.layout import Layout
from factory.layout.pinning import Pinning
from factory.layout.pins import Pins, StayingRobot, framed, same_module
from factory.layout.request import Ground
from factory.pipeline import Project
from factory.plant.factory import Factory
from factory.plant.matching import matching, shifted
from factory.plant.pairing import Pairing
from factory.support.errors import Diagnostic, RunError, usage_error
from factory.timing.timed import pace

Pin = Literal["all", "hands", "none"]
"""What is pinned of the old layout."""

SIMPLE = "give the PAG: `revise` compiles it with a robot for each tour"


@dataclass(frozen=True)
class Revision:
    """A product's factory and that of its next revision; `new` has its layout."""

    old: Project
    new: Project
    pairing: Pairing = field(repr=False)
    pins: Pins = field(repr=False)

    @cached_property
    def kept(self) -> tuple[StayingRobot, ...]:
        """The robots that stay."""
        pairing, layouts = self.pairing, (self.old.layout, self.new.layout)
        _, in_place = self.pins.in_place(self.new.layout)
        return tuple(
            StayingRobot(
                robot,
                other,
                pairing.keeps_program(robot),
                pairing.keeps_contents(robot),
                same_module(layouts, (robot, other)),
                other in in_place,
            )
            for robot, other in pairing.robots.items()
        )

    @property
    def gone(self) -> list[str]:
        """The names of robots that are no longer needed."""
        stay = self.pairing.robots
        return [r.name for r in self.old.layout.factory.robots if r.index not in stay]

    @property
    def added(self) -> list[str]:
        """The names of robots that are new."""
        stay = {*self.pairing.robots.values()}
        return [r.name for r in self.new.layout.factory.robots if r.index not in stay]

    @cached_property
    def inheritance(self) -> Inheritance:
        """What the certificate of the layout has from the old one."""
        shift, _ = self.pins.in_place(self.new.layout)
        return Inheritance.of(self.old.layout, self.new.layout, self.pairing, shift)

    def as_json(self, afresh: float | None = None) -> dict[str, Any]:
        """The document of `revise --json`; `afresh`: the cycle time of a fresh layout [s]."""
        names = [r.name for r in self.new.layout.factory.robots]
        matched, fields = self.pairing.matching, ("program", "contents", "module", "place")
        return {
            "product": self.new.pag.root,
            "robots": {"old": len(self.old.layout.factory.robots), "new": len(names)},
            "kept": [
                {"robot": names[k.new], **{name: getattr(k, name) for name in fields}}
                for k in self.kept
            ],
            "gone": self.gone,
            "added": self.added,
            "mapping": dict(matched.labels),
            "labels_changed": matched.changed,
            "labels_gone": matched.gone,
            "labels_added": matched.added,
            "moved_by_m": [*matched.shift],
            "pairs": self.inheritance.pairs,
            "pairs_inherited": self.inheritance.inherited,
            "pairs_computed": self.inheritance.computed,
            "cycle_time_s": {
                "old": pace(self.old.layout, self.old.settings)[0].seconds,
                "pinned": pace(self.new.layout, self.new.settings)[0].seconds,
                "afresh": afresh,
            },
        }

    def words(self, afresh: float | None = None) -> Iterator[str]:
        """The same for people, line by line."""
        matched, document = self.pairing.matching, self.as_json(afresh)
        changes = [
            f"{len(labels)} {what} ({_listed(labels)})"
            for what, labels in (
                ("gone", matched.gone),
                ("new", matched.added),
                ("changed", [f"{x} -> {y}" if x != y else x for x, y in matched.changed.items()]),
                ("renamed", [f"{x} -> {y}" for x, y in matched.renamed.items()]),
            )
            if labels
        ]
        words = ", ".join(changes) or "no label has changed"
        yield f"{self.old.pag.root} -> {self.new.pag.root}: {words}"
        robots, whole = document["robots"], sum(kept.whole for kept in self.kept)
        yield f"robots: {robots['old']} -> {robots['new']}. {whole} stay as they are"
        for words, grade in (
            ("have another program", "program"),
            ("hold something else", "contents"),
            ("have another hand, length, offset or arm", "module"),
            ("are in another place", "place"),
        ):
            some = [r["robot"] for r in document["kept"] if not r[grade]]
            if some:
                yield f"  {len(some)} {words}: {_listed(some)}"
        for words, names in (("gone", self.gone), ("new", self.added)):
            if names:
                yield f"  {len(names)} {words}: {_listed(names)}"
        pairs, inherited = document["pairs"], document["pairs_inherited"]
        yield (
            f"certificate: of {pairs} pairs of regions {inherited} are those of"
            f" {self.old.pag.root}, word for word; {pairs - inherited} computed"
        )
        times = document["cycle_time_s"]
        more = f", {afresh:.3f} s if laid out afresh" if afresh is not None else ""
        yield f"cycle {times['old']:.3f} -> {times['pinned']:.3f} s{more}"


def revised(old: Project, new: Project, pin: Pin = "all") -> Revision:
    """The revision of a product, laid out with the old layout `all` pinned, its `hands` alone, or
    `none` of it. Raises InputError (Usage) for shared robots, RunError (Layout) where
    the pinned layout is not clear."""
    for made in (old, new):
        made.pag.check_alone("revise")
        if not (made.plan.is_as_written and made.ground == Ground(made.ground.floor)):
            raise usage_error(f"'{made.file}' has shared robots", SIMPLE)
    matched = matching(old.pag, new.pag)
    if any(matched.shift):
        x, y, z = matched.shift
        new = new.with_pag(shifted(new.pag, (-x, -y, -z)))
        new.__dict__.pop("product", None)
        matched = replace(matching(old.pag, new.pag), shift=matched.shift)
    was = old.layout
    pairing = Pairing(matched, was.factory, new.plain)
    new = new.with_plan(replace(new.plan, names=_names(pairing)))
    factory = judged(new.plain, new.product)
    pairing = replace(pairing, new=factory)
    pins = Pins.of(was, pairing)
    layout = new.layout if pin == "none" else _laid_out(new, was, factory, pins, pin)
    new.__dict__["layout"] = layout
    return Revision(old, new, pairing, pins)


def _laid_out(new: Project, was: Layout, factory: Factory, pins: Pins, pin: Pin) -> Layout:
    product, settings = framed(new.product, was.product), new.settings
    hands = Hands(factory, product, settings.acceleration, pins.hands) if was.hands else None
    if pin == "hands":
        return new.ground.lay_out(factory, product, settings, hands)
    size, speed = Clearance(settings.clearance), Pace.of(settings)
    pinning = Pinning(factory, product, size, speed, hands, pins)
    layout = pinning.layout()
    if layout is None:
        faults = [fault.diagnostic() for fault in pinning.faults[:3]]
        message = f"the layout of '{new.pag.root}' with that of '{was.factory.pag.root}' pinned"
        hint = "--pin hands and --pin none lay it out afresh"
        raise RunError([Diagnostic("Layout", f"{message} is not clear", None, hint), *faults])
    return certified(layout, new.ground.floor, layout.certificate)


def _names(pairing: Pairing) -> tuple[str, ...]:
    """The names of the new robots: those that stay keep theirs, others have new numbers."""
    taken = [robot.name for robot in pairing.old.robots]
    names = {new: taken[old] for old, new in pairing.robots.items()}
    last = max(int(name.removeprefix("r")) for name in taken)
    numbers = count(last + 1)
    return tuple(names.get(robot.index) or f"r{next(numbers)}" for robot in pairing.new.robots)


def _listed(names: list[str], most: int = 8) -> str:
    more = len(names) - most
    return ", ".join(islice(names, most)) + (f" and {more} more" if more > 0 else "")
