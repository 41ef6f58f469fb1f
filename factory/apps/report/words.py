"""The proof of a net in words, from its verdict and certificate."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from factory.api import Factory, Verdict, verify
from factory.apps.exports.certificate.check import check_certificate
from factory.apps.exports.certificate.writer import certificate
from factory.support.errors import listing

NAMES = {
    "gear_net": "Gear net",
    "gear_train": "Gear train",
    "live": "Live",
    "safe": "Safe",
    "reversible": "Reversible",
    "legal": "Legal start",
}
MEANS = {
    "gear_net": "every robot has its own cycle, and robots share operations only",
    "gear_train": "every robot has its own cycle, with its own wait before each operation; robots"
    " share operations only",
    "live": "from every reachable marking, every operation can occur again: no deadlock",
    "safe": "no place ever holds two tokens: no robot has two tasks at once",
    "reversible": "the factory can always return to its initial marking",
    "legal": "at the start every robot is at exactly one place of its program",
}


@dataclass(frozen=True, slots=True)
class Claim:
    """A property, its meaning, whether it holds (None: undecided), and the reason, in words."""

    name: str
    means: str
    holds: bool | None
    why: str


@dataclass(frozen=True)
class Proof:
    """The claims, and the certificate: its digest, the faults found by its checker, the
    document."""

    claims: tuple[Claim, ...]
    digest: str
    faults: tuple[str, ...]
    document: dict[str, Any] = field(repr=False)

    @property
    def holds(self) -> bool:
        """Whether all claims are proved and the checker accepts them."""
        return not self.faults and all(claim.holds for claim in self.claims)


def proof(factory: Factory) -> Proof:
    """The proof of a factory's net."""
    verdict = verify(factory.net)
    document = certificate(factory.net, verdict)
    faults = tuple(str(fault) for fault in check_certificate(document))
    claims = tuple(_claim(name, factory, verdict, document) for name in verdict.properties)
    return Proof(claims, str(document["digest"]), faults, document)


def _claim(name: str, factory: Factory, verdict: Verdict, document: dict[str, Any]) -> Claim:
    holds: bool | None = getattr(verdict, name)
    if holds:
        why = " ".join(_WHY[name](factory, document[name]))
    else:
        why = "; ".join(str(w) for w in verdict.witness if w.property == name) or "undecided"
    return Claim(NAMES[name], MEANS[name], holds, why)


def _gear_net(factory: Factory, section: dict[str, Any]) -> Iterator[str]:
    order = section.get("order", [])
    names = [factory.robots[joint["gear"]].name for joint in order]
    yield f"The net is composed of {len(order)} gears, one for each robot, in the order"
    yield f"{listing(names, 8)}; each shares one operation with those before it."


def _gear_train(factory: Factory, section: dict[str, Any]) -> Iterator[str]:
    order = section.get("order") or []
    yield f"The {len(order)} transitions have an order in which the program of each of the"
    yield f"{len(factory.robots)} robots ascends from its token on: so one product at a time can be"
    yield "made, repeatedly."


def _safe(factory: Factory, section: dict[str, Any]) -> Iterator[str]:
    cover = section.get("cover", [])
    yield f"Each of the {len(cover)} places lies on the gear of a robot, a circuit with one token;"
    yield "firing a transition moves that token and never adds one."


def _live(factory: Factory, section: dict[str, Any]) -> Iterator[str]:
    yield f"The {len(section.get('order', []))} places without a token have an order in which"
    yield "each comes after all those that it waits for: no circuit is free of tokens."


def _reversible(factory: Factory, section: dict[str, Any]) -> Iterator[str]:
    yield "Live, and each place lies on a circuit: firing every transition equally often restores"
    yield "the marking."


def _legal(factory: Factory, section: dict[str, Any]) -> Iterator[str]:
    marked = section.get("marked", [])
    yield f"{len(marked)} robots, {len(marked)} marked places, one in each gear."


_WHY = {
    "gear_net": _gear_net,
    "gear_train": _gear_train,
    "safe": _safe,
    "live": _live,
    "reversible": _reversible,
    "legal": _legal,
}
