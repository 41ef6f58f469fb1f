"""Drives a written model as docs/guide/driving.md does, in whatever MuJoCo is installed here:
python driving.py FILE BLOCK. `BLOCK` is a text of Python, carried out as it is; then every robot
goes ahead from the start, with what it can take, or MuJoCo Warp is compared with C."""

from __future__ import annotations

import json
import sys
from typing import Any

import mujoco
import numpy as np

NEAR = 1e-3
"""A grip is closed on a part that is so near its place [m]."""


def start(m: Any) -> tuple[Any, float, int]:
    """A second from the start with setpoints of 0: the state, how far any coordinate has changed,
    and the most contacts."""
    d, touched, moved = mujoco.MjData(m), 0, 0.0
    for _ in range(round(1.0 / m.opt.timestep)):
        mujoco.mj_step(m, d)
        touched, moved = max(touched, d.ncon), max(moved, float(np.abs(d.qpos - m.qpos0).max()))
    return d, moved, touched


def take(m: Any, d: Any, robot: str) -> int:
    """A robot takes what its sensors show to be in its hand; how many parts that are."""
    welds = {m.equality(n).name: n for n in range(m.neq)}
    taken = 0
    for name, weld in welds.items():
        word, _, label = name.partition(f"/{robot}/")
        feeder = welds.get(f"feed/{label}", -1)
        if word == "grip" and feeder >= 0 and d.eq_active[feeder]:
            apart = np.abs(d.sensor(name).data - m.eq_data[weld, 3:6]).max()
            if apart < NEAR:
                d.eq_active[weld], d.eq_active[feeder] = 1, 0
                taken += 1
    return taken


def ahead(m: Any, robot: int) -> dict[str, Any]:
    """Robot i, of r1, r2 ..., goes 40 mm ahead from the start by `ctrl[i - 1]`, its lift up."""
    d, _, _ = start(m)
    name, touched = f"r{robot}", 0
    taken, address = take(m, d, name), int(m.joint(f"{name}/slide").qposadr[0])
    begin, steps = d.qpos.copy(), round(0.5 / m.opt.timestep)
    for n in range(2 * steps):
        d.ctrl[robot - 1] = 0.04 * min(1.0, n / steps)
        mujoco.mj_step(m, d)
        touched = max(touched, d.ncon)
    measured = float(d.sensor(f"{name}/slide/position").data[0])
    others = np.abs(np.delete(d.qpos - begin, address)[: m.nu - 1]).max() if not taken else 0.0
    off = abs(float(d.qpos[address]) - 0.04)
    return {
        "off": max(off, abs(measured - 0.04)),
        "others": float(others),
        "touched": touched,
        "taken": taken,
    }


def compared(m: Any, names: dict[str, Any]) -> float:
    """How far the worlds of MuJoCo Warp, as the block has left them, are from C [m]."""
    apart, grip, feeder = 0.0, m.equality("grip/r5/part1").id, m.equality("feed/part1").id
    for world, taken in enumerate((False, True)):
        d = mujoco.MjData(m)
        d.eq_active[grip], d.eq_active[feeder] = taken, not taken
        for n in range(1, 21):
            d.ctrl[m.actuator("r5/drive").id] = 0.001 * n * taken
            mujoco.mj_step(m, d)
        apart = max(apart, float(np.abs(names["data"].qpos.numpy()[world] - d.qpos).max()))
    return apart


if __name__ == "__main__":
    file, block = sys.argv[1:]
    names: dict[str, Any] = {}
    exec(block, names)
    m = mujoco.MjModel.from_xml_path(file)
    found: dict[str, Any] = {"version": mujoco.__version__}
    if "mujoco_warp" in names:
        found["apart"] = compared(m, names)
    else:
        _, found["moved"], found["touched"] = start(m)
        robots = sum(m.actuator(n).name.endswith("/drive") for n in range(m.nu)) - 1
        found["robots"] = [ahead(m, n + 1) for n in range(robots)]
    print(json.dumps(found))
