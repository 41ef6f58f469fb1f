"""Bins: open boxes of thin plates on the floor, for what is scrap."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree.ElementTree import Element

from factory.engine.mjcf import names
from factory.engine.mjcf.elements import add_station
from factory.floor.layout.bins import PLATE, SILL, Bin
from factory.floor.layout.layout import Layout
from factory.support.xml_writer import add

DEEP = 0.1
"""So far below the floor a bin's bottom goes on, unseen: nothing falls through it between two
timesteps [m]."""

RED = (0.62, 0.30, 0.27, 1.0)


def add_bins(world: Element, layout: Layout, bins: Iterable[Bin]) -> None:
    """The bins of a layout. All that moves collides with them."""
    for one in bins:
        name = names.bin_of(layout.factory.robots[one.robot].name)
        x, y = one.middle
        half = (one.box[1] - one.box[0]) / 2, (one.box[3] - one.box[2]) / 2
        body = add(world, "body", name=name, pos=(x, y, 0.0))
        place = {"pos": (0.0, 0.0, (PLATE - DEEP) / 2), "size": (*half, (PLATE + DEEP) / 2)}
        add_station(body, f"{name}/bottom", **place, rgba=RED)
        for axis, letter in enumerate("xy"):
            for side in (-1, 1):
                high = SILL if side * one.near[axis] > 0 else Bin.TOP
                at, plate = [0.0, 0.0, high / 2], [*half, high / 2]
                at[axis], plate[axis] = side * (half[axis] - PLATE / 2), PLATE / 2
                wall = f"{name}/{letter}{side}"
                add_station(body, wall, pos=tuple(at), size=tuple(plate), rgba=RED)
