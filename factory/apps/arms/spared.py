"""What stands and does not count as in an arm's way, by its names: on a transfer, and where an arm
takes something or places it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from factory.api import Layout, LayoutMachines
from factory.apps.arms.arrangement import Arrangement
from factory.apps.arms.lines import Line
from factory.apps.arms.obstacles import feeder_name, limb_name, placed_name

TOUCHING = "pad", "jaw"
"""What the limbs of a hand are called that touch what it holds."""


@dataclass(frozen=True, eq=False)
class Spared:
    """What does not count.

    Attributes:
        cell: where things stand.
        bare: the layout without legs.
    """

    cell: Arrangement
    bare: Layout

    @cached_property
    def moving(self) -> frozenset[str]:
        """On a transfer: what is on a carrier, and its hand, which all is within what that
        takes."""
        return frozenset().union(*map(self.on, self.cell.lines.values()))

    def on(self, line: Line) -> set[str]:
        """What is on a line at its station, and the limbs of its carrier's hand."""
        parts = {placed_name(part, line) for part in line.rails.product.solids}
        return parts | self.hand(line)

    def hand(self, line: Line, but: tuple[str, ...] = ()) -> set[str]:
        """The limbs of the hand of a line's carrier, `but` those of some names."""
        every = LayoutMachines(self.bare).limbs(line.carrier)
        return {limb_name(limb.name, line) for limb in every if not limb.name.endswith(but)}

    def at(self, label: str, loaded: bool = False) -> set[str]:
        """Where the tool takes something: its feeder, or the carrier that it is on with the part
        that it touches there, and where the tool is loaded with all of it, and with what holds it;
        the rest of the carrier's hand counts."""
        burden, cell = self.cell.burdens[label], self.cell
        if burden.source is None:
            return {f"'{label}'", feeder_name(label), *self.moving}
        line = cell.lines[burden.source]
        there = {placed_name(part, line) for part in burden.parts}
        touched = there if loaded else {placed_name(burden.hold.part, line)}
        hand = self.hand(line, TOUCHING if loaded else ())
        return {line.name, *self.moving} - (there - touched) - hand

    def under(self, label: str) -> set[str]:
        """Where the tool places something, and where it leaves that: the carrier but for its hand,
        and all but what it is placed onto."""
        burden = self.cell.burdens[label]
        line = self.cell.lines[burden.onto]
        there = {placed_name(part, line) for part in burden.there}
        return {line.name, f"'{label}'", *self.moving} - there - self.hand(line)
