"""Lifts for lines whose labels are held at different heights: the robot sets its hand for each."""

from __future__ import annotations

from dataclasses import replace

from factory.geometry.solids import Product
from factory.layout.hands.choosing import Hands
from factory.layout.hands.holding import held
from factory.layout.hands.places import PUSH
from factory.plant.factory import Factory
from factory.problem.robot_types import LIFT, Catalogue


def with_lifts(
    factory: Factory, product: Product, catalogue: Catalogue, push: float = PUSH
) -> Factory:
    """The factory, in which robots with several tours have lifts where one hand then holds all that
    they bring, but without lifts none does; its plan says which."""
    types = [catalogue.meet(robot.type, LIFT) for robot in factory.robots]
    lacking = {
        robot.index
        for robot, kind in zip(factory.robots, types, strict=True)
        if kind is not None and robot.index not in factory.strokes
    } & without_hands(Hands(factory, product, push))
    tried = replace(factory, adjusted=frozenset(lacking))
    still = without_hands(Hands(tried, product, push), however=True) if lacking else set()
    adjusted = frozenset(lacking - still)
    robots = tuple(
        replace(robot, type=types[robot.index] or LIFT) if robot.index in adjusted else robot
        for robot in factory.robots
    )
    plan = replace(factory.plan, lifts=adjusted)
    return replace(factory, robots=robots, adjusted=adjusted, plan=plan)


def without_hands(hands: Hands, however: bool = False) -> set[int]:
    """The robots with several tours that have no hand in some way that they may lie, or `however`
    they lie."""
    found = set[int]()
    for robot, tours in enumerate(hands.tours.of):
        if len(tours) > 1 and held(hands.holding.factory, tours[0]):
            chosen = (hands.hand(robot, u, t) for u, t in hands.holding.frames(tours[0]))
            none = [hand is None or hand.kind == "none" for hand in chosen]
            if all(none) if however else any(none):
                found.add(robot)
    return found
