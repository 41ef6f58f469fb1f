"""Verdicts on nets: the properties that hold, and a witness for each that does not."""

from __future__ import annotations

import builtins
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from factory.support.errors import Position
from factory.support.showing import Told
from factory.theory.nets.gears import Gear
from factory.theory.nets.marked import MarkedNet
from factory.theory.problem.pag import NOPART

BEHAVIOUR = ("live", "safe", "reversible", "legal")
PROPERTIES = ("gear_net", *BEHAVIOUR)


@dataclass(frozen=True, slots=True)
class Defect:
    """Why a property fails, or is undecided.

    Attributes:
        property: the property.
        kind: one of a few fixed phrases (`lost token`, `unclosed gear`, ...).
        reason: the same in full.
        gears: those concerned (index).
        places: those concerned (index).
        transitions: those concerned (index); a firing sequence where the kind speaks of one.
    """

    MOST: ClassVar[int] = 10

    property: str
    kind: str
    reason: str
    gears: tuple[int, ...] = ()
    places: tuple[int, ...] = ()
    transitions: tuple[int, ...] = ()

    @classmethod
    def no_gear_net(
        cls,
        kind: str,
        reason: str,
        gears: Iterable[int] = (),
        places: Iterable[int] = (),
        transitions: Iterable[int] = (),
    ) -> Defect:
        """A defect that makes a net no gear net. Each gear is named once."""
        return cls(
            "gear_net", kind, reason, tuple(dict.fromkeys(gears)), tuple(places), tuple(transitions)
        )

    @classmethod
    def no_way_back(cls, net: MarkedNet, event: int) -> Defect:
        """The defect of a net that is not reversible: a transition that can fire is connected to
        one that fires finitely often."""
        name = net.net.transitions[event].name
        text = f"{name} can fire, after which the initial marking is unreachable"
        return cls("reversible", "no way back", text, transitions=(event,))


@dataclass(frozen=True, slots=True)
class Witness:
    """A defect by names: robots, labels, places and transitions, and where they come from."""

    property: str
    kind: str
    reason: str
    robots: tuple[str, ...] = ()
    labels: tuple[str, ...] = ()
    places: tuple[str, ...] = ()
    transitions: tuple[str, ...] = ()
    sources: tuple[Position, ...] = ()

    @builtins.property
    def lines(self) -> tuple[str, ...]:
        """The source lines, as `file:line`."""
        return tuple(dict.fromkeys(f"{at.file}:{at.line}" for at in self.sources))

    def __str__(self) -> str:
        """The property, why it fails, and the source lines concerned."""
        where = f" ({', '.join(self.lines)})" if self.lines else ""
        return f"not {self.property.replace('_', ' ')}: {self.reason}{where}"

    def as_json(self) -> dict[str, object]:
        """The witness as the `--json` document lists it."""
        texts, rows = ("property", "kind", "reason"), ("robots", "labels", "places", "transitions")
        return {
            **{name: getattr(self, name) for name in texts},
            **{name: list(getattr(self, name)) for name in (*rows, "lines")},
        }


@dataclass(frozen=True)
class Verdict(Told):
    """The properties of a net, each True, False, or None where it is undecided.

    Attributes:
        gear_net: whether it is composed of its gears (Definition 3.6).
        live: whether each transition can fire again, whatever has fired.
        safe: whether no place ever has two tokens.
        reversible: whether it can return to the initial marking, whatever has fired.
        legal: whether the initial marking is legal: one token in each gear.
        witness: a counterexample for each property that is not True; a defect of a gear train may
            be listed with `gear_net`.
        gears: the gears, claimed or discovered.
        method: how the behaviour was decided: `structure` or `exploration`.
        gear_train: whether gears are glued along places of several robots; a gear net is one, too.

    For a gear net under a legal marking, live, safe and reversible are Theorems 3.1 and 3.2.
    """

    gear_net: bool | None
    live: bool | None
    safe: bool | None
    reversible: bool | None
    legal: bool | None
    witness: tuple[Witness, ...] = ()
    gears: tuple[Gear, ...] = field(default=(), repr=False)
    method: str = "structure"
    gear_train: bool | None = None

    def __repr__(self) -> str:
        words = {True: "", None: "undecided: ", False: "not "}
        claims = (words[getattr(self, name)] + name.replace("_", " ") for name in self.properties)
        return f"<Verdict by {self.method}: {', '.join(claims)}>"

    @property
    def properties(self) -> tuple[str, ...]:
        """The properties required of a factory's net: gear net, or gear train, and its
        behaviour."""
        train = self.gear_train and not self.gear_net
        return ("gear_train" if train else "gear_net", *BEHAVIOUR)

    @property
    def holds(self) -> bool:
        """Whether every required property is proved."""
        return all(getattr(self, name) is True for name in self.properties)

    @property
    def faults(self) -> tuple[Witness, ...]:
        """The witnesses against the required properties."""
        train = "gear_train" in self.properties
        return tuple(w for w in self.witness if not (train and w.property == "gear_net"))

    def as_json(self) -> dict[str, object]:
        """The verdict's keys of the `--json` document."""
        names = (*PROPERTIES, "gear_train")
        holds: dict[str, object] = {name: getattr(self, name) for name in names}
        return {**holds, "method": self.method, "witness": [w.as_json() for w in self.witness]}

    @classmethod
    def of(
        cls,
        net: MarkedNet,
        defects: Iterable[Defect],
        gear_train: bool | None,
        sources: Mapping[str, Position] | None,
        method: str = "structure",
    ) -> Verdict:
        """The verdict on a net with these defects: a property without defects holds, one whose
        defects are all `undecided` is None. `sources`: source positions of robots by name."""
        listed = tuple(defects)
        kinds = {name: {d.kind for d in listed if d.property == name} for name in PROPERTIES}
        holds = {name: None if k == {"undecided"} else not k for name, k in kinds.items()}
        witness = tuple(_witness(net, defect, sources or {}) for defect in listed)
        gears = net.gears
        return cls(**holds, witness=witness, gears=gears, method=method, gear_train=gear_train)


def _witness(net: MarkedNet, against: Defect, sources: Mapping[str, Position]) -> Witness:
    places, events = net.net.places, net.net.transitions
    concerned = against.gears or _owners(net, against.places)
    robots = [net.gears[g].robot for g in concerned]
    subjects = list(against.places)
    labels = _labels(net, subjects)
    if not labels:
        near = [q for e in against.transitions for q in net.net.preset[e] + net.net.postset[e]]
        subjects += near or [p for g in concerned for p in net.gears[g].places]
        labels = _labels(net, subjects)
    at = [places[p].position for p in subjects]
    at += [events[e].position for e in against.transitions]
    at += [sources.get(robot) for robot in robots]
    return Witness(
        against.property,
        against.kind,
        against.reason,
        tuple(robots),
        labels,
        tuple(places[p].name for p in against.places),
        tuple(events[e].name for e in against.transitions),
        tuple(dict.fromkeys(position for position in at if position)),
    )


def _owners(net: MarkedNet, places: tuple[int, ...]) -> tuple[int, ...]:
    """The gears through all the places; without any, those through some of them."""
    if not net.slots or not places:
        return ()
    gears = range(len(net.gears))
    rows = [[g for g in net.slots[p] if g in gears] for p in places]
    common = set(rows[0]).intersection(*rows)
    return tuple(dict.fromkeys(g for row in rows for g in row if g in common or not common))


def _labels(net: MarkedNet, places: Iterable[int]) -> tuple[str, ...]:
    named = (net.net.places[p].label for p in places)
    return tuple(dict.fromkeys(label for label in named if label not in ("", NOPART)))
