"""The machines of a layout, as those see them that read a layout: bodies, regions, and the net that
keeps them apart."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from factory.floor.layout.bending import Detour, bent
from factory.floor.layout.carrying_back import not_carried_back
from factory.floor.layout.certificate import Certificate, Exclusions, Fault, Precedence, Region
from factory.floor.layout.clearance import certify
from factory.floor.layout.coordinating import Coordinated, with_machines
from factory.floor.layout.crowding import Crowding, crowding_faults
from factory.floor.layout.embedding import certified
from factory.floor.layout.exclusions import awaited_positions, coordinated, waiting_for_ever
from factory.floor.layout.feeding import cleared, feeder_of, passing
from factory.floor.layout.guidepath import Feeder
from factory.floor.layout.hands.leaving import homes
from factory.floor.layout.hands.limbs import Limb, limbs
from factory.floor.layout.hanging import Hanging
from factory.floor.layout.layout import Layout
from factory.floor.layout.machines import presences
from factory.floor.layout.outfeed import away, shed_with_uprights
from factory.floor.layout.presence import ROUNDING, Presence
from factory.floor.layout.starting import start_positions
from factory.floor.layout.staying import Staying, in_world
from factory.floor.layout.sweeps import piles_of, regions, regions_of
from factory.support.arrays import Array
from factory.support.boxes import Box, Point2
from factory.support.settings import Settings
from factory.theory.nets.coordinated import Past
from factory.theory.nets.petri import Marking
from factory.theory.plant.operation import Operation


@dataclass(frozen=True, slots=True)
class LayoutMachines:
    """The robots of a layout, their feeders and the outfeed: of what bodies they are, where they
    go, and what keeps them apart. What is costly is computed once for a layout.

    Attributes:
        layout: the layout.
    """

    ROUNDING: ClassVar[float] = ROUNDING

    layout: Layout

    def limbs(self, robot: int) -> tuple[Limb, ...]:
        """The limbs of a robot's hand; none for a tool, or where nothing can hold."""
        return limbs(self.layout, robot)

    def limbs_at(self, robot: int, at: Point2) -> Iterator[tuple[str, Array]]:
        """The name of each limb of a robot's hand, and its box (2, 3) where the robot's carriage
        stands at a point of the floor [m]."""
        for limb in self.limbs(robot):
            heading = self.layout.guidepaths[robot].heading
            yield limb.name, in_world(np.array([[limb.low, limb.high]]), heading, at)[0]

    def feeder(self, label: str) -> Feeder:
        """The feeder of a part."""
        return feeder_of(self.layout, label)

    @property
    def sliders(self) -> Hanging:
        """From which slider of its feeder each part hangs, and where."""
        return Hanging.of(self.layout)

    def passing(self, leaf: Operation) -> float:
        """How far a feeder's robot goes until it is clear of the part that comes down next [m]."""
        return passing(self.layout, leaf)

    def cleared(self, robot: int, sideways: float) -> float:
        """The same for a robot that goes straight ahead from its feeder (0), or to its side t (+1),
        or to the other (-1)."""
        return cleared(self.layout, robot, sideways)

    @property
    def not_carried_back(self) -> frozenset[tuple[int, str]]:
        """The pairs of a robot (index) and a label that it cannot carry back to its B end."""
        return not_carried_back(self.layout)

    @property
    def shed(self) -> tuple[Box, float]:
        """The box of the outfeed's shed with the uprights of its shutter, and its height [m]."""
        return shed_with_uprights(self.layout)

    def outfeed_time(self, settings: Settings) -> float:
        """Time from one dropoff until the next may begin [s]."""
        return away(self.layout, settings)

    @property
    def regions(self) -> list[Region]:
        """The floor that robots, payloads and stations sweep, robot by robot."""
        return regions(self.layout)

    def bent(self, detours: Mapping[int, Detour]) -> Layout:
        """The layout in which the guidepaths of some robots (index) are bent; not certified."""
        return bent(self.layout, detours)

    def bent_regions(self, robot: int, detour: Detour | None) -> tuple[Layout, list[Region]]:
        """The layout with a robot's guidepath bent, if there is a detour, and the regions of that
        robot there, with its feeder, or with the outfeed."""
        layout = self.layout if detour is None else self.bent({robot: detour})
        return layout, [*regions_of(layout, robot, piles_of(self.layout))]

    @property
    def crowding(self) -> Crowding:
        """What compares regions in plan."""
        return Crowding(self.layout)

    @property
    def crowding_faults(self) -> list[Fault]:
        """What is wrong with the layout as far as can be told without its net."""
        return crowding_faults(self.layout)

    @property
    def homes(self) -> dict[int, float]:
        """The robots (index) whose hands must be in place before what they take, and the arc length
        of that place [m]."""
        return homes(self.layout)

    @property
    def coordinated(self) -> Coordinated:
        """The coordinated net, with everything that keeps the machines apart."""
        return coordinated(self.layout)

    def coordinated_with(
        self, passes: Iterable[Past], orders: Sequence[Precedence] = ()
    ) -> Coordinated:
        """The coordinated net with passes of robots on their way home and order places of one's
        own in place of those of the certificate."""
        return with_machines(self.layout, passes, orders)

    def kept_apart(
        self, orders: Sequence[tuple[Past, Operation, int]], backs: Mapping[int, float]
    ) -> Exclusions:
        """What keeps machines apart where each of some operations starts only after a pass, at most
        so many times more often, and robots (index) return by themselves to arc lengths [m]; with a
        fault where the coordinated net is not live."""
        passes = tuple(dict.fromkeys(past for past, *_ in orders))
        net = self.coordinated_with(passes)
        called = [transition.name for transition in net.net.net.transitions]
        before = {past: called[net.net.right[place]] for past, (place, _) in net.passes.items()}
        places = tuple(
            Precedence(
                f"order:{before[past]}:{operation.label}",
                before[past],
                called[operation.start],
                tokens,
            )
            for past, operation, tokens in orders
        )
        if (whole := self.coordinated_with(passes, places)).deadlock:
            return Exclusions(faults=(waiting_for_ever(self.layout, whole),))
        return Exclusions(passes=passes, orders=places, backs=tuple(backs.items()))

    @property
    def awaited(self) -> dict[int, float]:
        """Where robots (index) go that return by themselves, arc lengths [m]."""
        return awaited_positions(self.layout)

    @property
    def presences(self) -> Iterator[Presence]:
        """Where all machines are, place by place of the coordinated net."""
        return presences(self.layout, self.coordinated, self.awaited)

    def robot_presences(self, net: Coordinated) -> Iterator[Presence]:
        """Where the robots are, place by place of a coordinated net of the layout."""
        return Staying(self.layout, net, self.awaited).presences()

    def certify(self) -> Certificate:
        """The clearance certificate of the layout, computed from the layout alone."""
        return certify(self.layout)

    def certified(
        self, floor: Point2 | None = None, certificate: Certificate | None = None
    ) -> Layout:
        """The layout with its certificate, or a given one, and the floor that it takes. Raises
        RunError (Layout) where the certificate does not hold, or the layout takes more than a width
        and depth [m]."""
        return certified(self.layout, floor, certificate)

    def starts(self, marking: Marking) -> Array:
        """The position of every axis in a marking [m; rad where it turns]."""
        return start_positions(self.layout, marking)
