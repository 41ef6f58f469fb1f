"""The drawn model of a run, compiled: dressed, and what is written on it turned to the camera."""

from __future__ import annotations

from collections.abc import Mapping
from math import atan2, degrees

from factory.engine.mjcf.replica import Replica
from factory.film.action import action_of
from factory.film.dress import dressed
from factory.film.filament import settings
from factory.film.look import CLASSIC_FLOOR, FILAMENT_FLOOR
from factory.film.picture import Camera
from factory.film.vantage import overview
from factory.support.compiling import compiled
from factory.support.engine import mujoco
from factory.support.pictures.sight import Framing

SOUTH = -90.0
"""Azimuth from which a plan is read [degrees]."""

USUAL = Framing(16 / 9)
"""The framing of a picture without words."""


def drawn(
    m: mujoco.MjModel,
    xml: str,
    files: Mapping[str, bytes],
    camera: Camera,
    filament: bool = False,
    framing: Framing = USUAL,
) -> mujoco.MjModel:
    """The drawn model of a run's model `m`, whose MJCF and mesh files these are, for the classic
    renderer or for Filament; words can be read in an overview of this framing."""
    facing = SOUTH if camera == "top" else _azimuth(m, framing)
    text = dressed(xml, m, facing, FILAMENT_FLOOR if filament else CLASSIC_FLOOR)
    if filament:
        text = text.replace("</mujoco>", f"{settings()}</mujoco>")
    return compiled(text, files)


def _azimuth(m: mujoco.MjModel, framing: Framing) -> float:
    """Where the camera `overview` stands, seen from the factory [degrees]."""
    replica = Replica(m)
    ahead = overview(action_of(replica.m, replica.d), framing).axes[2]
    return degrees(atan2(-ahead[1], -ahead[0]))
