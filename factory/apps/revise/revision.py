"""The next revision of a product: what stays of its factory, and the layout that keeps most of it.

A robot that stays keeps its name. Grades of what stays, each for itself: the *program*, but for
names of labels; the *contents*, all that it ever holds; the *module*, its hand, length, offset and
arm; the *place* in the world.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import count
from typing import Any, Literal, get_args

from factory.api import (
    NOPART,
    Factory,
    Ground,
    Hands,
    Layout,
    LayoutMachines,
    LayoutSearch,
    Pace,
    Project,
    RunError,
    pace,
)
from factory.apps.revise.inheriting import Inheritance
from factory.apps.revise.matching import matching, shifted
from factory.apps.revise.pairing import Pairing
from factory.apps.revise.pinning import Pinning
from factory.apps.revise.pins import Pins, StayingRobot, framed, same_module
from factory.apps.revise.revision_picture import draw_revision
from factory.support.errors import usage_error

Pin = Literal["all", "hands", "none"]
"""What is pinned of the old layout, the most first."""


@dataclass(frozen=True)
class Revision:
    """A product's factory and that of its next revision; `new` has its layout, in which so much of
    the old one is `pinned` of what was `asked`."""

    old: Project
    new: Project
    pairing: Pairing = field(repr=False)
    pins: Pins = field(repr=False)
    asked: Pin
    pinned: Pin

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

    def __repr__(self) -> str:
        whole = sum(one.whole for one in self.kept)
        counts = f"{whole} as they were, {len(self.added)} new, {len(self.gone)} gone"
        return f"<Revision {self.title}: {len(self.kept)} robots stay, {counts}>"

    def _repr_svg_(self) -> str:
        return self.drawing

    @property
    def drawing(self) -> str:
        """What stays, on the floor plan of the new factory, as SVG."""
        layouts = self.old.layout, self.new.layout
        return draw_revision(self.title, layouts, self.kept, self.inheritance.shift)

    @property
    def gone(self) -> list[str]:
        """The names of robots that are no longer needed."""
        stay = self.pairing.robots
        return [r.name for r in self.pairing.old.robots if r.index not in stay]

    @property
    def added(self) -> list[str]:
        """The names of robots that are new."""
        stay = {*self.pairing.robots.values()}
        return [r.name for r in self.pairing.new.robots if r.index not in stay]

    @property
    def title(self) -> str:
        """What becomes what: the products, or their files where these have the same name."""
        old, new = self.old.pag.root, self.new.pag.root
        return f"{self.old.file.name} -> {self.new.file.name}" if old == new else f"{old} -> {new}"

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
            "labels_reordered": matched.reordered,
            "moved_by_m": [*matched.shift],
            "pinned": self.pinned,
            "pairs": self.inheritance.pairs,
            "pairs_inherited": self.inheritance.inherited,
            "pairs_computed": self.inheritance.pairs - self.inheritance.inherited,
            "cycle_time_s": {
                "old": pace(self.old.layout, self.old.settings)[0].seconds,
                "pinned": pace(self.new.layout, self.new.settings)[0].seconds,
                "afresh": afresh,
            },
        }

    def words(self, afresh: float | None = None) -> Iterator[str]:
        """The same for people, line by line."""
        matched, document = self.pairing.matching, self.as_json(afresh)
        changes = (
            ("gone", dict.fromkeys(matched.gone)),
            ("new", dict.fromkeys(matched.added)),
            ("changed", matched.changed),
            ("in another order", matched.reordered),
            ("renamed", matched.renamed),
        )
        listed = ", ".join(f"{len(x)} {what} ({_listed(x)})" for what, x in changes if x)
        yield f"{self.title}: {listed or 'no label has changed'}"
        whole = sum(kept.whole for kept in self.kept)
        yield "robots: {old} -> {new}. {} as they were".format(whole, **document["robots"])
        grades = (
            ("with another program", "program"),
            ("with other contents", "contents"),
            ("with another hand, length, offset or arm", "module"),
            ("in another place", "place"),
        )
        for words, some in (
            *((w, [r["robot"] for r in document["kept"] if not r[grade]]) for w, grade in grades),
            ("gone", [_last(self.pairing.old, name) for name in self.gone]),
            ("new", [_last(self.pairing.new, name) for name in self.added]),
        ):
            if some:
                yield f"  {len(some)} {words}: {_listed(some)}"
        if self.pinned != self.asked:
            yield f"--pin {self.asked}: no layout found; this is that of --pin {self.pinned}"
        yield (
            "certificate: of {pairs} pairs that come near {pairs_inherited} have a circuit of the"
            " old one, word for word; {pairs_computed} are new".format(**document)
        )
        more = f", {afresh:.3f} s if laid out afresh" if afresh is not None else ""
        yield "cycle {old:.3f} -> {pinned:.3f} s{}".format(more, **document["cycle_time_s"])


def revised(old: Project, new: Project, pin: Pin = "all") -> Revision:
    """The revision of a product, laid out with the old layout `all` pinned, its `hands` alone, or
    `none` of it; where that is not clear, with less. Raises InputError (Usage) for shared robots,
    RunError (Layout) where there is no layout even afresh."""
    for made in (old, new):
        made.pag.check_alone("revise")
        made.compiled.check_rails("revise")
        if not (made.plan.is_as_written and made.ground == Ground(made.ground.floor)):
            hint = "give the PAG: `revise` compiles it with a robot for each tour"
            raise usage_error(f"'{made.file}' has shared robots", hint)
    matched = matching(old.pag, new.pag)
    if any(matched.shift):
        x, y, z = matched.shift
        new = new.with_pag(shifted(new.pag, (-x, -y, -z)))
        new.__dict__.pop("product", None)
        matched = replace(matching(old.pag, new.pag), shift=matched.shift)
    was = old.layout
    pairing = Pairing(matched, was.factory, new.plain)
    new = new.with_plan(replace(new.plan, names=_names(pairing)))
    factory = LayoutSearch(new.plain, new.product).judged
    pairing = replace(pairing, new=factory)
    pins = Pins.of(was, pairing)
    ways: tuple[Pin, ...] = get_args(Pin)
    for tried in ways[ways.index(pin) :]:
        try:
            new.__dict__["layout"] = _laid_out(new, was, factory, pins, tried)
            return Revision(old, new, pairing, pins, pin, tried)
        except RunError as error:
            refused = error
    raise refused


def _laid_out(new: Project, was: Layout, factory: Factory, pins: Pins, pin: Pin) -> Layout:
    if pin == "none":
        return new.layout
    product, settings = framed(new.product, was.product), new.settings
    hands = Hands(factory, product, settings.acceleration, pins.hands)
    if pin == "hands":
        return new.ground.lay_out(factory, product, settings, hands)
    search = LayoutSearch(factory, product, settings.clearance, Pace.of(settings), hands)
    pinning = Pinning(search, pins)
    layout = pinning.layout()
    if layout is None:
        raise RunError(fault.diagnostic() for fault in pinning.faults)
    return LayoutMachines(layout).certified(new.ground.floor, layout.certificate)


def _names(pairing: Pairing) -> tuple[str, ...]:
    """The names of the new robots: those that stay keep theirs, others have new numbers."""
    taken = [robot.name for robot in pairing.old.robots]
    names = {new: taken[old] for old, new in pairing.robots.items()}
    last = max(int(name.removeprefix("r")) for name in taken)
    numbers = count(last + 1)
    return tuple(names.get(robot.index) or f"r{next(numbers)}" for robot in pairing.new.robots)


def _last(factory: Factory, name: str) -> str:
    """The name of a robot with what it does last, and to which label."""
    robot = next(robot.index for robot in factory.robots if robot.name == name)
    last = factory.last(robot)
    held = last.before[last.robots.index(robot)]
    return f"{name} ({last.template.name} {last.label if held == NOPART else held})"


def _listed(names: Sequence[str] | Mapping[str, str | None], most: int = 8) -> str:
    if isinstance(names, Mapping):
        names = [x if y in (x, None) else f"{x} -> {y}" for x, y in names.items()]
    more = len(names) - most
    return ", ".join(names[:most]) + (f" and {more} more" if more > 0 else "")
