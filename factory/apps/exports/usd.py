"""USD (z upwards, metres; binary, or text in a file *.usda) of a log's motion, frame by frame, by
MuJoCo's own exporter."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from factory.apps.exports.motion import BodyMotion, motion_of
from factory.apps.exports.subject import Subject
from factory.apps.log import Log
from factory.support.errors import usage_error
from factory.support.version import optional

FORMAT, TAKES, BINARY = "usd", "log", True

NAME = "usd"
"""Name of the exporter's folder, within a temporary one."""


def export(subject: Subject) -> Mapping[str, bytes]:
    """The stage and its textures. Raises MissingError where there is no usd-core, InputError
    (Usage) for a package."""
    ending = Path(subject.name).suffix.lower()
    if ending == ".usdz":
        raise usage_error(f"'{subject.name}' would be a package", "give *.usd, *.usdc or *.usda")
    usd = optional("pxr.Usd", "usd-core", "USD", "usd")
    motion = motion_of(subject.log)
    textures = f"{Path(subject.name or subject.stem).stem}_textures"
    with tempfile.TemporaryDirectory() as folder:
        _record(motion, subject.log, folder, "usda" if ending == ".usda" else "usdc")
        (written,) = Path(folder, NAME, "frames").iterdir()
        _finish(usd, written, motion, subject.log, textures)
        files = {"": written.read_bytes()}
        for image in sorted(Path(folder, NAME, "assets").iterdir()):
            files[f"{textures}/{image.name}"] = image.read_bytes()
    return files


def _record(motion: BodyMotion, log: Log, folder: str, encoding: str) -> None:
    """Write every frame with MuJoCo's exporter, in text (usda) or binary (usdc)."""
    from factory.api import Replica
    from factory.support.engine import mujoco

    exporter = optional("mujoco.usd.exporter", "usd-core", "USD", "usd")
    replica = Replica(motion.m)
    m, d = replica.m, replica.d
    scene = exporter.USDExporter(
        model=m, output_directory=NAME, output_directory_root=folder, verbose=False
    )
    for row in motion.rows:
        replica.place(log.qpos[row])
        mujoco.mj_comPos(m, d)
        mujoco.mj_camlight(m, d)
        scene.update_scene(d)
    scene.save_scene(encoding)


def _finish(usd: Any, path: Path, motion: BodyMotion, log: Log, textures: str) -> None:
    """Set the frame rate of the log, and paths of textures beside the file."""
    utilities = optional("pxr.UsdUtils", "usd-core", "USD", "usd")
    stage = usd.Stage.Open(str(path))
    step = float(np.median(np.diff(log.time[motion.rows]))) if len(motion.rows) > 1 else 1.0
    stage.SetTimeCodesPerSecond(round(1 / step, 6))
    optional("pxr.UsdGeom", "usd-core", "USD", "usd").SetStageMetersPerUnit(stage, 1.0)
    layer = stage.GetRootLayer()
    utilities.ModifyAssetPaths(layer, lambda asset: f"{textures}/{Path(asset).name}")
    layer.Save()
