"""Lifts for lines whose labels are held at different heights: the robot adjusts its hand for
each."""

from __future__ import annotations

from dataclasses import replace

from factory.floor.layout.hands.choosing import Hands
from factory.floor.layout.hands.holding import held
from factory.theory.problem.robot_types import LIFT, Catalogue


def lifts_for(hands: Hands, catalogue: Catalogue) -> frozenset[int]:
    """The robots (index) of the factory of `hands` with several tours and no lift for which one
    hand suits all labels with a lift, and none without."""
    factory, product, push = hands.factory, hands.holding.product, hands.holding.push
    lacking = {
        robot.index
        for robot in factory.robots
        if not factory.goes_up(robot.index) and catalogue.meet(robot.type, LIFT) is not None
    } & without_hands(hands)
    if not lacking:
        return frozenset()
    tried = replace(factory, adjusted=frozenset(lacking))
    return frozenset(lacking - without_hands(Hands(tried, product, push), however=True))


def without_hands(hands: Hands, however: bool = False) -> set[int]:
    """The robots with unlike tours that have no hand in some frame, or `however` in none."""
    robots = set[int]()
    for robot, tours in enumerate(hands.tours.of):
        if len({*hands.tours.alike(tours)}) > 1 and held(hands.holding.factory, tours[0]):
            chosen = (hands.hand(robot, u, t) for u, t in hands.holding.frames(tours[0]))
            none = (hand is None or not hand.kind.holds for hand in chosen)
            if all(none) if however else any(none):
                robots.add(robot)
    return robots
