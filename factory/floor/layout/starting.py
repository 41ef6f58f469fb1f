"""Where the axes of a factory are in a marking."""

from __future__ import annotations

import numpy as np

from factory.floor.layout.hands.limbs import rises_first
from factory.floor.layout.layout import Layout
from factory.theory.nets.petri import Marking


def start_positions(layout: Layout, marking: Marking) -> np.ndarray:
    """Every axis in a marking. A robot is where its last operation left it, or at its B end if it
    waits without a payload at the beginning of its cycle; then its lift is where its last tour left
    it, unless it is adjusted by then or its hand is above what it takes.

    Args:
        layout: the layout.
        marking: a legal marking of its net.
    """
    factory, net = layout.factory, layout.factory.net
    positions = np.zeros(len(factory.axes))
    for robot, gear in zip(factory.robots, net.gears, strict=True):
        step, _ = gear.step_in(marking)
        positions[robot.index] = layout.home(robot.index, robot.operations[step])
        always = robot.index in factory.adjusted or rises_first(layout, robot.index)
        if (up := factory.up(robot.index)) is not None:
            before, visit = layout.ways[robot.operations[step], robot.index]
            positions[up] = visit.up if step or always else before.lift
    return positions
