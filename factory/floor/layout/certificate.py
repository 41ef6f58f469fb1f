"""The clearance certificate of a layout, as a value: the floor that machines take, what keeps those
apart that come near each other, and the faults."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from factory.floor.layout.dimensions import ARMS, CARRIAGES, PAYLOADS, Clearance
from factory.support.boxes import Box
from factory.support.errors import Diagnostic, Position
from factory.support.showing import Told
from factory.theory.nets.coordinated import Past
from factory.theory.plant.factory import Factory

MILLI = 1000.0

NAMES = ("carriages", "masts and arms", "payloads")
"""The layers' names."""

KINDS = (
    *("carriage", "mast", "arm", "payload", "post", "boom", "outfeed"),
    *("housing", "shed", "hand", "bin"),
)
"""What a region is swept by."""

CARRIAGE_BODY, MAST_BODY, ARM_BODY, PAYLOAD_BODY, POST_BODY, BOOM, OUTFEED = range(7)
HOUSING, SHED, HAND_BODY, BIN_BODY = range(7, len(KINDS))
STATIONS = (POST_BODY, BOOM, OUTFEED, HOUSING, SHED, BIN_BODY)
RAISED = (BOOM, HOUSING)
"""Stations that stand clear of the floor: payloads go below them."""

LOADS = (PAYLOAD_BODY, HAND_BODY)
"""What robots carry, and hold it with."""

ALWAYS = -1
"""The mode of a region that is uncoupled."""


@dataclass(frozen=True, slots=True)
class Region:
    """A rectangle in one layer that a body may take.

    Attributes:
        robot: its robot (index); a station counts to the robot it serves.
        layer: the layer, from the floor up: CARRIAGES, ARMS, PAYLOADS.
        kind: what takes it: ARM, PAYLOAD, POST, or another of `KINDS`.
        box: the rectangle [m].
        z: heights from low to high, with a lift up [m].
        label: what the robot carries there.
        mode: the operation (index) in whose mode the robot is there; ALWAYS where it may be there
            in any.
    """

    CARRIAGES: ClassVar[int] = CARRIAGES
    ARMS: ClassVar[int] = ARMS
    PAYLOADS: ClassVar[int] = PAYLOADS
    ARM: ClassVar[int] = ARM_BODY
    PAYLOAD: ClassVar[int] = PAYLOAD_BODY
    POST: ClassVar[int] = POST_BODY

    robot: int
    layer: int
    kind: int
    box: Box
    z: tuple[float, float]
    label: str = ""
    mode: int = ALWAYS

    @property
    def is_payload(self) -> bool:
        """Whether it is swept by what a robot carries."""
        return self.kind == PAYLOAD_BODY

    @property
    def stands(self) -> bool:
        """Whether it is of a station."""
        return self.kind in STATIONS

    @property
    def is_coupled(self) -> bool:
        """Whether its robot is there in the mode of one operation only."""
        return self.mode != ALWAYS

    def named(self, factory: Factory) -> str:
        """The region in words."""
        if self.kind in (OUTFEED, SHED):
            return "the outfeed" if self.kind == OUTFEED else "the outfeed's shed"
        if self.kind in STATIONS and self.kind != BIN_BODY:
            return f"the {KINDS[self.kind]} of '{self.label}''s feeder"
        label = f" '{self.label}'" if self.label else ""
        return f"{factory.robots[self.robot].name}'s {KINDS[self.kind]}{label}"


@dataclass(frozen=True, slots=True)
class Fault:
    """A violation of the certificate: the robots, the distance `lacking` [m], and the positions in
    the user's file."""

    message: str
    robots: tuple[str, ...]
    lacking: float = 0.0
    positions: tuple[Position | None, ...] = ()

    def diagnostic(self) -> Diagnostic:
        """The fault as an error (Layout) at the first robot's line."""
        places = [str(place) for place in self.positions[1:] if place is not None]
        hint = f"the other robot comes from {', '.join(places)}" if places else ""
        first = self.positions[0] if self.positions else None
        return Diagnostic("Layout", self.message, first, hint)

    def as_json(self) -> dict[str, object]:
        """The fault as the certificate's document lists it."""
        return {
            "message": self.message,
            "robots": list(self.robots),
            "lacking_mm": round(self.lacking * MILLI, 3),
            "positions": [None if p is None else str(p) for p in self.positions],
        }


def fault(factory: Factory, message: str, *robots: int, lacking: float = 0.0) -> Fault:
    """A fault of robots (index)."""
    named = [factory.robots[robot] for robot in robots]
    names, positions = (robot.name for robot in named), (robot.position for robot in named)
    return Fault(message, tuple(names), lacking, tuple(positions))


@dataclass(frozen=True, slots=True)
class Excluded:
    """Two machines that would come near in two places of the coordinated net: the `bodies`, and the
    places of a `circuit` with one token through both places, so that they are never marked
    together."""

    machines: tuple[str, str]
    places: tuple[str, str]
    bodies: tuple[str, str]
    circuit: tuple[str, ...]

    def as_json(self) -> dict[str, object]:
        """The pair as the certificate's document lists it."""
        return {
            "machines": list(self.machines),
            "places": list(self.places),
            "bodies": list(self.bodies),
            "circuit": list(self.circuit),
        }


@dataclass(frozen=True, slots=True)
class Precedence:
    """An order place by `name` that keeps machines apart: `start` fires at most `tokens` times more
    often than `before` (names of transitions of the coordinated net)."""

    name: str
    before: str
    start: str
    tokens: int

    def as_json(self) -> dict[str, object]:
        """The order place as the certificate's document lists it."""
        return {"place": self.name, "tokens": self.tokens}


@dataclass(frozen=True, slots=True)
class Exclusions:
    """What keeps the machines of a layout apart: the pairs that come near, each with its circuit;
    the order places and passes needed for that; the robots (index) that return by themselves, each
    to an arc length [m]; and the pairs that nothing keeps apart."""

    excluded: tuple[Excluded, ...] = field(default=(), repr=False)
    orders: tuple[Precedence, ...] = field(default=(), repr=False)
    passes: tuple[Past, ...] = field(default=(), repr=False)
    backs: tuple[tuple[int, float], ...] = field(default=(), repr=False)
    faults: tuple[Fault, ...] = ()


@dataclass(frozen=True, slots=True)
class Certificate(Told):
    """The certificate that machines cannot touch, nor what they hold.

    Attributes:
        clearance: least distance between bodies of different machines in one layer, except between
            what one holds and another that works with it [m]. End stops are beyond the regions by
            less than half of that.
        layers: name and z range of each layer [m].
        gaps: vertical distance of each layer to the one below [m].
        robots: their names.
        operations: their labels.
        regions: floor that each body covers in each operation.
        faults: what it fails for; at most `clearance.MOST` of each kind.
        apart: what keeps machines apart that come near each other.

    It holds if there is no fault.
    """

    clearance: float
    layers: tuple[tuple[str, float, float], ...]
    gaps: tuple[tuple[str, float], ...]
    robots: tuple[str, ...] = field(repr=False)
    operations: tuple[str, ...] = field(repr=False)
    regions: tuple[Region, ...] = field(repr=False)
    faults: tuple[Fault, ...] = ()
    apart: Exclusions = field(default_factory=Exclusions, repr=False)

    def __repr__(self) -> str:
        result = "holds" if self.holds else f"FAILS with {len(self.faults)} faults"
        what = f"{len(self.robots)} robots, {len(self.apart.excluded)} pairs that come near"
        return f"<Certificate: {result}, {what}, clearance {1e3 * self.clearance:g} mm>"

    @property
    def holds(self) -> bool:
        """Whether there is no fault."""
        return not self.faults

    def is_of(self, factory: Factory) -> bool:
        """Whether the certificate is of a factory with these operations and robots."""
        names = tuple(robot.name for robot in factory.robots)
        return (names, tuple(o.label for o in factory.operations)) == (self.robots, self.operations)

    def as_json(self) -> dict[str, object]:
        """The certificate as a document that another program can check."""
        return {
            "schema": 2,
            "holds": self.holds,
            "clearance_m": self.clearance,
            "stops_beyond_m": round(Clearance(self.clearance).stop, 6),
            "layers": [
                {"layer": name, "z_low_m": round(low, 6), "z_high_m": round(high, 6)}
                for name, low, high in self.layers
            ],
            "vertical_gaps_m": {name: round(gap, 6) for name, gap in self.gaps},
            "regions": [self._region(region) for region in self.regions],
            "excluded": [excluded.as_json() for excluded in self.apart.excluded],
            "orders": [order.as_json() for order in self.apart.orders],
            "faults": [fault.as_json() for fault in self.faults],
        }

    def summary(self) -> dict[str, object]:
        """Its figures: whether it holds, the clearance [m], and the number of regions and of pairs
        that come near."""
        return {
            "holds": self.holds,
            "clearance_m": self.clearance,
            "regions": len(self.regions),
            "excluded": len(self.apart.excluded),
        }

    def _region(self, region: Region) -> dict[str, object]:
        return {
            "robot": self.robots[region.robot],
            "layer": NAMES[region.layer],
            "of": KINDS[region.kind],
            "label": region.label or None,
            "box": [round(v, 6) for v in region.box],
            "z": [round(v, 6) for v in region.z],
            "operation": None if region.mode == ALWAYS else self.operations[region.mode],
        }
