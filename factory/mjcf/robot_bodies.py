"""All robots of a layout: a body each, of its type's file, with its hand and its actuators."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree.ElementTree import Element

from factory.layout.hands.hand import Hand
from factory.layout.hands.limbs import limbs
from factory.layout.layout import Layout
from factory.mjcf.hands import Styles, load_hand
from factory.mjcf.plates import add_number
from factory.mjcf.robots import Drive, Held, Hoist, RobotModel, instantiate, load_robot_model
from factory.mjcf.scene import add_follower
from factory.mjcf.stops import carriage_stops
from factory.plant.factory import Factory
from factory.problem.robot_types import Catalogue


def add_robots(
    layout: Layout,
    catalogue: Catalogue,
    drives: tuple[Drive, ...],
    hoists: Mapping[int, Hoist],
    section: Mapping[str, Element],
) -> None:
    """The robots' bodies, actuators, and what their types' files share, into the sections of a
    model."""
    factory = layout.factory
    models: dict[str, RobotModel] = {}
    styles: dict[str, Styles] = {}
    for robot, path, drive in zip(factory.robots, layout.guidepaths, drives, strict=True):
        if robot.type not in models:
            model = models[robot.type] = load_robot_model(catalogue[robot.type])
            section["default"].append(model.defaults)
            section["asset"].extend(model.assets)
        role = role_of(factory, robot.index)
        held = Held(_low(layout, robot.index))
        if layout.hands:
            held = Held(0.0, _style(layout.hand(robot.index), styles), limbs(layout, robot.index))
        body, actuators = instantiate(
            models[robot.type],
            robot.name,
            path,
            drive,
            carriage_stops(layout, robot.index),
            held,
            role,
            hoists.get(robot.index),
        )
        add_number(body, section["asset"], robot.name, path, role)
        if robot.index == 0:
            add_follower(body, layout)
        section["worldbody"].append(body)
        section["actuator"].extend(actuators)


def _low(layout: Layout, robot: int) -> float:
    """How far above z0 the lowest point of a robot's payload is carried, with its lift down [m]."""
    factory, product = layout.factory, layout.product
    ground, found = float(product.low[2]), list[float]()
    for tour, label in zip(factory.tours[robot], factory.deliveries(robot), strict=False):
        low = min(float(product.solids[part].low[2]) for part in factory.contents[label])
        found.append(low - ground + layout.visits[tour[0], robot].height)
    first = factory.robots[robot].operations[0]
    return min(found, default=layout.visits[first, robot].height)


def _style(hand: Hand | None, loaded: dict[str, Styles]) -> Styles:
    """What the limbs of a hand and its tip look like, each file read once; nothing for none."""
    if hand is None or hand.kind == "none":
        return {}
    for name in (hand.kind, hand.tip):
        if name not in loaded:
            loaded[name] = load_hand(name)
    return {**loaded[hand.kind], **loaded[hand.tip]}


def role_of(factory: Factory, robot: int) -> str:
    """What a robot does, for its paint."""
    if robot == 0:
        return "output"
    if factory.robots[robot].fixed or not factory.deliveries(robot):
        return "tool"
    first = factory.operations[factory.robots[robot].operations[0]]
    return "carrier" if first.inputs else "fed"
