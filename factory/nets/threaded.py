"""Threaded Petri Nets: Definition 3.2; `factory.nets.threads` has 3.3 and 3.4.

The dynamics F_p, domain D_p and goal G_p of a place are found by its mode and label in the factory
(`factory.plant.factory`); the net itself keeps what the theory needs: sizes and redistribution.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from factory.nets.petri import PetriNet, Place, Transition

Slot = tuple[int, int]
"""(p, i): component i of the mode of place p; both counted from 0."""

Redistribution = tuple[tuple[Slot, Slot], ...]
"""d_e as pairs (slot before, slot after), sorted (Definition 3.2, item 4)."""


@dataclass(frozen=True)
class ThreadedNet:
    """A Threaded Petri Net (Definition 3.2): a net and a redistribution function for each event.

    Raises ValueError where some d_e is not a bijection from the slots of •e to those of e•.
    """

    net: PetriNet
    redistribution: tuple[Redistribution, ...] = field(repr=False)

    def __post_init__(self) -> None:
        sizes = [place.size for place in self.net.places]
        preset, postset = self.net.preset, self.net.postset
        for event, pairs in enumerate(self.redistribution):
            before = [slot for slot, _ in pairs]
            after = [slot for _, slot in pairs]
            wanted = [(p, i) for p in preset[event] for i in range(sizes[p])]
            reached = [(q, i) for q in postset[event] for i in range(sizes[q])]
            if sorted(before) != wanted or sorted(after) != reached:
                name = self.net.transitions[event].name
                raise ValueError(f"the redistribution function of {name} is not a bijection")

    @property
    def transitions(self) -> tuple[Transition, ...]:
        """T."""
        return self.net.transitions

    @property
    def places(self) -> tuple[Place, ...]:
        """P."""
        return self.net.places
