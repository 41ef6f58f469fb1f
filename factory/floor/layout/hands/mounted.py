"""The limbs of a hand: boxes and rods from the carriage to the payload, stretched to its places."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

from factory.floor.layout.dimensions import BEAM, FINGER, FINGER_LOW, FINGER_TOP
from factory.floor.layout.hands.clamp import PALM
from factory.floor.layout.hands.hand import PAD, ROOT, Hand, Point3
from factory.floor.layout.hands.kinds import ABOVE, BEHIND, BELOW, NONE, HandKind
from factory.floor.layout.hands.reach import AIR
from factory.support.boxes import Extent, Point2
from factory.theory.problem.robot_bodies import ARM_LOW, ARM_TOP, CARRIAGE_TOP, MAST

Round = Literal["", "x", "z"]


@dataclass(frozen=True, slots=True)
class Limb:
    """A limb in the frame of its robot: x ahead of the carriage, y to the left of it, z above the
    floor with the lift down. Its box from `low` to `high` [m]; the axis along which it is `round`,
    "" for a box; whether it is `lifted` with the payload."""

    name: str
    low: Point3
    high: Point3
    round: Round = ""
    lifted: bool = False


@dataclass(frozen=True, slots=True)
class Mount:
    """Where a hand is mounted: the `heading` u of its robot and the `side` t of its frame; how far
    behind the product's middle the carriage is (`reach`) and the arm ends (`arm`), and how far to
    the side t the carriage's line is (`offset`); the product's `middle` (x, y); how far above the
    floor the product's frame is with the lift down (`up`), and how far that goes up (`stroke`) [m];
    whether it has a lift."""

    heading: Point2
    side: Point2
    reach: float
    arm: float
    offset: float
    middle: Point2
    up: float = 0.0
    stroke: float = 0.0
    lifted: bool = False

    @property
    def left(self) -> float:
        """+1 where the side t is to the left of the heading u, -1 where it is to the right."""
        return self.heading[0] * self.side[1] - self.heading[1] * self.side[0]

    def reached(self, hand: Hand) -> list[Point3]:
        """The points of contact of the pads, in the robot's frame, nearest first."""
        (x, y), (u, v), (s, t) = self.middle, self.heading, self.side
        points = []
        for px, py, pz in hand.places:
            ahead = (px - x) * u + (py - y) * v + self.reach
            aside = ((px - x) * s + (py - y) * t - self.offset) * self.left
            points.append((round(ahead, 6), round(aside, 6) + 0.0, round(pz + self.up, 6)))
        return sorted(points)


def limbs_of(hand: Hand, mount: Mount) -> tuple[Limb, ...]:
    """The limbs of a mounted hand; empty if nothing can hold."""
    return tuple(LIMBS[hand.kind](mount, hand))


def grip_of(hand: Hand, mount: Mount) -> Extent | None:
    """The box about the product's middle, in the robot's frame (u, t), of what a hand and its mast
    take among the payloads; None for nothing."""
    limbs = limbs_of(hand, mount)
    if not limbs:
        return None
    ahead = [limb.low[0] for limb in limbs], [limb.high[0] for limb in limbs]
    sides = min(limb.low[1] for limb in limbs), max(limb.high[1] for limb in limbs)
    across = sorted(mount.offset + side * mount.left for side in sides)
    return min(ahead[0]) - mount.reach, max(ahead[1]) - mount.reach, across[0], across[1]


def _below(mount: Mount, hand: Hand) -> Iterator[Limb]:
    reached, half, lifted = mount.reached(hand), hand.column / 2, mount.lifted
    rim, end = mount.reach - mount.arm - ROOT, reached[-1][0]
    aside = reached[0][1]
    width = hand.width / 2
    beside = aside - width, aside + width
    if abs(aside) > FINGER / 2:  # in a lane: it goes across below the fingers of others
        low, high = min(0.0, beside[0]), max(0.0, beside[1])
        yield Limb("cross", (rim, low, ARM_LOW), (rim + ROOT, high, ARM_TOP))
        yield Limb("riser", (rim, beside[0], ARM_TOP), (rim + ROOT, beside[1], FINGER_LOW))
    yield Limb(
        "finger",
        (min(rim, end - width), aside - width, FINGER_LOW),
        (end + width, aside + width, FINGER_TOP),
    )
    for number, (x, y, z) in enumerate(reached, 1):
        top, which = z - AIR, f"{number}/" if len(reached) > 1 else ""
        yield from _rod(f"{which}column", x, y, half, FINGER_TOP, top - PAD, lifted)
        low = max(top - PAD, FINGER_TOP)
        yield from _rod(f"{which}pad", x, y, hand.radius, low, top, lifted)
    yield from _clamp(mount, hand)


def _behind(mount: Mount, hand: Hand) -> Iterator[Limb]:
    (x, y, z), stroke = mount.reached(hand)[0], mount.stroke
    half, end, lifted = hand.width / 2, x - AIR, mount.lifted
    yield Limb(
        "tower",
        (-MAST / 2, y - MAST / 2, CARRIAGE_TOP),
        (MAST / 2, y + MAST / 2, z + half + stroke),
    )
    start = MAST / 2 + 0.001
    yield Limb("bar", (start, y - half, z - half), (end - PAD, y + half, z + half), "", lifted)
    r = hand.radius
    yield Limb("pad", (end - PAD, y - r, z - r), (end, y + r, z + r), "x", lifted)


def _above(mount: Mount, hand: Hand) -> Iterator[Limb]:
    (x, y, z), stroke = mount.reached(hand)[0], mount.stroke
    beam, lifted = round(hand.beam + mount.up, 6), mount.lifted
    half, wide, top = FINGER / 2, hand.width / 2, beam + BEAM
    yield Limb("tower", (-MAST / 2, -MAST / 2, CARRIAGE_TOP), (MAST / 2, MAST / 2, top + stroke))
    start = MAST / 2 + 0.001
    yield Limb("beam", (start, -half, beam), (x + wide, half, top), "", lifted)
    if abs(y) > half:
        low, high = sorted((half if y > 0 else -half, y + wide if y > 0 else y - wide))
        yield Limb("cross", (x - wide, low, beam), (x + wide, high, top), "", lifted)
    foot = z + AIR
    yield from _rod("stem", x, y, hand.column / 2, foot + PAD, beam, lifted)
    yield from _rod("pad", x, y, hand.radius, foot, foot + PAD, lifted)
    yield from _clamp(mount, hand)


def _clamp(mount: Mount, hand: Hand) -> Iterator[Limb]:
    """The palm and the jaws, each with all its way."""
    if hand.clamp is None:
        return
    for name, ends in hand.clamp.boxes(mount.reached(hand)[0], hand.beam + mount.up):
        (a, b, c), (d, e, f) = ((round(v, 6) for v in end) for end in ends)
        called = name if name.startswith(PALM) else f"{name}/jaw"
        yield Limb(called, (a, b, c), (d, e, f), "", mount.lifted)


def _rod(
    name: str, x: float, y: float, radius: float, low: float, high: float, lifted: bool
) -> Iterator[Limb]:
    if high - low > 1e-5:
        yield Limb(name, (x - radius, y - radius, low), (x + radius, y + radius, high), "z", lifted)


LIMBS: Mapping[HandKind, Callable[[Mount, Hand], Iterable[Limb]]] = {
    NONE: lambda _mount, _hand: (),
    BELOW: _below,
    BEHIND: _behind,
    ABOVE: _above,
}
"""The limbs of the kinds of hands."""
