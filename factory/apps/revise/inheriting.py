"""Inherited entries of a clearance certificate (Theorem 12): an entry names a circuit that keeps
two machines from being near each other at once, and is right wherever they are.

So where the circuit of an old entry is one of the new net, and still carries one token, the entry
holds, word for word; only the pairs that come near where none did are new.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from factory.api import Layout, LayoutMachines, MarkedNet
from factory.apps.revise.pairing import Pairing
from factory.support.boxes import Point2


@dataclass(frozen=True)
class Inheritance:
    """Which `entries` of a certificate (index) are which of another's, of so many `pairs` that come
    near. `shift`: by how much the floor of the new layout lies elsewhere [m]."""

    entries: Mapping[int, int] = field(repr=False)
    pairs: int
    shift: Point2

    @property
    def inherited(self) -> int:
        """The number of entries that are inherited."""
        return len(self.entries)

    @classmethod
    def of(cls, old: Layout, new: Layout, pairing: Pairing, shift: Point2) -> Inheritance:
        """What the certificate of a layout has from that of another. Both have one."""
        assert old.certificate is not None and new.certificate is not None, "both are certified"
        names, net, held = (
            Renaming(pairing),
            LayoutMachines(new).coordinated.net,
            dict[object, int](),
        )
        for number, entry in enumerate(old.certificate.apart.excluded):
            if is_circuit(net, names.of(entry.circuit)):
                held[_key(names.of(entry.machines), names.of(entry.places))] = number
        entries = new.certificate.apart.excluded
        keys = {n: _key(entry.machines, entry.places) for n, entry in enumerate(entries)}
        return cls({n: held[key] for n, key in keys.items() if key in held}, len(entries), shift)


class Renaming:
    """The names of machines and places of an old factory, as they are in the new one."""

    def __init__(self, pairing: Pairing) -> None:
        old, new = pairing.old, pairing.new
        self._words = {one.label: f"no longer {one.label}" for one in old.operations}
        self._words |= {one.name: f"no longer {one.name}" for one in old.robots}
        for one, other in pairing.operations.items():
            self._words[old.operations[one].label] = new.operations[other].label
        for one, other in pairing.robots.items():
            self._words[old.robots[one].name] = new.robots[other].name

    def of(self, names: Iterable[str]) -> tuple[str, ...]:
        """The new names of some old ones."""
        words = (re.split("([: ])", name) for name in names)
        return tuple("".join(self._words.get(word, word) for word in each) for each in words)


def is_circuit(net: MarkedNet, names: tuple[str, ...]) -> bool:
    """Whether places of these names follow each other in a circle, which carries one token."""
    numbers = {place.name: number for number, place in enumerate(net.net.places)}
    if not names or not numbers.keys() >= {*names}:
        return False
    circuit = [numbers[name] for name in names]
    onward = zip(circuit, (*circuit[1:], circuit[0]), strict=True)
    follow = all(net.right[here] == net.left[then] for here, then in onward)
    return follow and sum(net.tokens[place] for place in circuit) == 1


def _key(machines: tuple[str, ...], places: tuple[str, ...]) -> object:
    return frozenset(zip(machines, places, strict=True))
