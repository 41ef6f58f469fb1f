"""Jaws as MJCF: the bodies of a robot type's file, put where the hand holds, with their drives.

A jaw is drawn open. Its joint is how far it has closed; its box reaches from the palm up to beside
the payload.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import ceil
from xml.etree.ElementTree import Element

from factory.engine.mjcf import names
from factory.engine.mjcf.driving import HOIST_STIFFNESS, drive_for
from factory.engine.mjcf.robots import Drive, add_drive
from factory.engine.mjcf.stops import stops_of
from factory.floor.layout.hands.clamp import Clamp
from factory.floor.layout.layout import Layout
from factory.support.settings import Settings
from factory.support.xml_writer import numbers
from factory.theory.plant.gripping import JAW_ACCELERATION, jaw_time
from factory.theory.plant.robot import Robot
from factory.theory.problem.robot_bodies import Jaw


def clamps_of(layout: Layout) -> Iterator[tuple[Robot, Clamp]]:
    """The robots with clamps."""
    for robot in layout.factory.robots:
        hand = layout.hand(robot.index)
        if hand is not None and hand.clamp is not None:
            yield robot, hand.clamp


def jaw_ticks(layout: Layout, settings: Settings) -> int:
    """No stroke of a jaw takes more ticks."""
    strokes = (jaw.stroke for _, clamp in clamps_of(layout) for jaw in clamp.jaws)
    return ceil(jaw_time(max(strokes, default=0.0)) / settings.tick) + 4


def add_jaws(world: Element, actuator: Element, layout: Layout, settings: Settings) -> int:
    """Put the jaws of all robots where their hands hold, and add their drives. Returns how many
    there are. Those of robots without a hand stay where they are drawn, and are only shown."""
    samples = (jaw_ticks(layout, settings) + 2 * settings.stride) * settings.steps + 2
    clamps = {robot.name: clamp for robot, clamp in clamps_of(layout)}
    bodies = {body.get("name"): body for body in world.iter("body")}
    count = 0
    for robot in layout.factory.robots:
        for jaw in robot.body.jaws:
            body = bodies[names.jaw(robot.name, jaw.name)]
            joint, geom = body.findall("joint")[0], body.findall("geom")[0]
            if robot.name not in clamps:
                body.remove(joint)
                geom.attrib.update(contype="0", conaffinity="0", group="1")
                continue
            geom.attrib.update(_box(layout, robot, clamps[robot.name], jaw))
            geom.set("name", names.jaw_face(robot.name, jaw.name))
            drive = replace(jaw_drive(jaw, settings), samples=samples)
            add_drive(actuator, joint, drive, stops_of(0.0, jaw.stroke, layout.clearance))
            count += 1
    return count


def jaw_drive(jaw: Jaw, settings: Settings) -> Drive:
    """The drive of a jaw, as strong as its motor."""
    moved = jaw.mass + jaw.armature
    drive = drive_for(moved, 0.0, JAW_ACCELERATION, settings, HOIST_STIFFNESS)
    return replace(drive, force=jaw.force)


def _box(layout: Layout, robot: Robot, clamp: Clamp, jaw: Jaw) -> dict[str, str]:
    """Place and size of the box of an open jaw."""
    hand = layout.hand(robot.index)
    assert hand is not None
    mount = layout.mount(robot.index)
    boxes = clamp.boxes(mount.reached(hand)[0], hand.beam + mount.up, open_=True)
    ends = dict(boxes)[jaw.name]
    middle = [round((low + high) / 2, 9) for low, high in zip(*ends, strict=True)]
    half = [round((high - low) / 2, 9) for low, high in zip(*ends, strict=True)]
    return {"pos": numbers(middle), "size": numbers(half)}
