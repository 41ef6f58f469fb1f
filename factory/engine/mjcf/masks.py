"""Contact masks by holder.

A holder of parts (a robot, the outfeed's tray, a feeder) has a code. What it holds has the code for
its contype and the code's complement for its conaffinity, so two such things collide exactly if
their codes differ. The lowest bit is that of robots and stations, which collide with all of them.
"""

from __future__ import annotations

from collections.abc import Iterable

from factory.floor.layout.feeding import Outlet
from factory.theory.plant.factory import Factory

NOBODY = 0
"""The code of no holder: such a part, a spare one out of sight, touches nothing."""

LOOSE = 1 << 27
"""The codes of bodies that nothing holds begin here, above those of all holders."""

ALL = (1 << 30) - 1
"""All bits of a code."""


def masks_of(holder: int) -> tuple[int, int]:
    """Contype and conaffinity of what a holder (its code) holds, and of what touches that by
    design."""
    return holder << 1, 0 if holder == NOBODY else ((~holder & ALL) << 1) | 1


def loose_code(body: int) -> int:
    """The code of a body (its number in the engine) that nothing holds any more: it collides with
    all others, those in the same hands before among them."""
    return LOOSE + body


def robot_code(robot: int) -> int:
    """The code of a robot (index)."""
    return robot + 1


def tray_code(factory: Factory) -> int:
    """The code of the outfeed's tray."""
    return len(factory.robots) + 1


def feeder_codes(factory: Factory, outlets: Iterable[Outlet]) -> dict[int, int]:
    """The code of the feeder of each robot (index) that has one, by the outlets of feeders."""
    fed = dict.fromkeys(outlet.robot for outlet in outlets)
    return {robot: n for n, robot in enumerate(fed, tray_code(factory) + 1)}
