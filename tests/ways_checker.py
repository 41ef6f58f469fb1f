"""A checker that no two machines of a factory ever meet, which knows no layout.

It takes what `factory build` writes: the MJCF, the ways of the machines with the places of the net,
and the pairs that come near with their circuits. It sweeps the geoms of the bodies along the ways,
finds what comes near, and asks for the circuit: one that is closed, goes through a place of both,
and carries one token. Only the engine's loader is used, and numpy.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

Json = dict[str, Any]
Boxes = NDArray[np.float64]

NEAREST = 2e-5
"""Bodies whose boxes are no further apart are near [m]."""


def check(m: mujoco.MjModel, ways: Json, clearance: Json) -> list[str]:
    """What is wrong, [] where no two machines ever meet."""
    places = {row["place"]: row for row in ways["places"]}
    wrong, apart = list[str](), set[tuple[str, str]]()
    for pair in clearance["excluded"]:
        if reason := _circuit(places, pair):
            wrong.append(f"{' and '.join(pair['machines'])}: {reason}")
        else:
            apart.update([tuple(pair["places"]), tuple(reversed(pair["places"]))])
    swept = [(way, _swept(m, way)) for way in ways["ways"]]
    for (one, mine), (other, its) in combinations(swept, 2):
        if one["machine"] == other["machine"] or {*one["places"]} & {*other["places"]}:
            continue
        bodies = _near(mine, its)
        both = ((p, q) for p in one["places"] for q in other["places"])
        if bodies and apart.isdisjoint(both):
            sides = zip(bodies, (one, other), strict=True)
            named = " and ".join(f"{body} in {' and '.join(w['places'])}" for body, w in sides)
            wrong.append(f"{named} come near, and no circuit excludes that")
    return wrong


def _circuit(places: dict[str, Json], pair: Json) -> str:
    """Why a circuit does not exclude a pair, "" if it does."""
    circuit = pair["circuit"]
    if not all(name in places for name in (*circuit, *pair["places"])):
        return f"its circuit is not of the net: {', '.join(circuit)}"
    if not {*pair["places"]} <= {*circuit}:
        return f"its circuit is not through {' and '.join(pair['places'])}"
    rows = [places[name] for name in circuit]
    for row, onward in zip(rows, rows[1:] + rows[:1], strict=True):
        if row["after"] != onward["before"]:
            return f"its circuit breaks between {row['place']} and {onward['place']}"
    tokens = sum(row["tokens"] for row in rows)
    return "" if tokens == 1 else f"its circuit carries {tokens} tokens: {', '.join(circuit)}"


def _swept(m: mujoco.MjModel, way: Json) -> tuple[list[str], Boxes]:
    """The geoms of a machine and of what it holds, and the boxes that they sweep."""
    d = mujoco.MjData(m)
    mujoco.mj_kinematics(m, d)
    names, boxes = list[str](), list[Boxes]()
    joints = [m.joint(name).id for name in way["joints"]]
    for body in way["bodies"]:
        solid = (g for g in _geoms(m, body) if m.geom_contype[g] or m.geom_conaffinity[g])
        for geom in solid:
            at = _box(m, geom, d.geom_xpos[geom], d.geom_xmat[geom].reshape(3, 3))
            standing = m.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CYLINDER
            standing &= abs(abs(d.geom_xmat[geom][8]) - 1.0) < 1e-9
            _sweep(m, d, (m.body(body).id, joints), way["spans"], at, boxes, standing)
            names += [m.geom(geom).name] * len(way["spans"])
    for weld in map(m.equality, way["welds"]):
        holder, part = int(m.eq_obj1id[weld.id]), int(m.eq_obj2id[weld.id])
        turn, place = _turn(m.eq_data[weld.id][6:10]), m.eq_data[weld.id][3:6]
        here = d.xmat[holder].reshape(3, 3)
        for geom in _shapes(m, part):
            at = d.xpos[holder] + here @ (place + turn @ m.geom_pos[geom])
            box = _box(m, geom, at, here @ turn @ _turn(m.geom_quat[geom]))
            _sweep(m, d, (holder, joints), way["spans"], box, boxes)
            names += [m.geom(geom).name] * len(way["spans"])
    return names, np.array(boxes).reshape(-1, 2, 3)


def _sweep(
    m: mujoco.MjModel,
    d: mujoco.MjData,
    moved: tuple[int, list[int]],
    spans: list[list[list[float]]],
    box: Boxes,
    boxes: list[Boxes],
    standing: bool = False,
) -> None:
    """Add what a box of a body sweeps as joints go over spans, one group after the other. One that
    turns about the vertical comes first: it is the body's own. What is in the box may be a
    `standing` cylinder."""
    body, joints = moved
    for group in spans:
        swept = box.copy()
        for joint, (low, high) in zip(joints, group, strict=True):
            if m.jnt_bodyid[joint] not in _above(m, body):
                continue
            begin = m.qpos0[m.jnt_qposadr[joint]]
            if m.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE:
                turns = np.linspace(low - begin, high - begin, 90) * d.xaxis[joint][2]
                swept = _turned(swept, d.xanchor[joint], turns, standing)
                continue
            ends = np.outer([low - begin, high - begin], d.xaxis[joint])
            swept += [ends.min(axis=0), ends.max(axis=0)]
        boxes.append(swept)


def _turned(box: Boxes, anchor: Boxes, turns: Boxes, standing: bool) -> Boxes:
    """The box of a box, or of a cylinder that stands in it, which turns about a vertical axis."""
    half = (box[1] - box[0]) / 2 * standing
    ends = np.array([box[0] + half, box[1] - half])
    x, y = np.meshgrid(ends[:, 0] - anchor[0], ends[:, 1] - anchor[1])
    c, s = np.cos(turns)[:, None], np.sin(turns)[:, None]
    u, v = c * x.ravel() - s * y.ravel() + anchor[0], s * x.ravel() + c * y.ravel() + anchor[1]
    low, high = box[:, 2]
    plan = np.array([[u.min(), v.min()], [u.max(), v.max()]]) + np.outer([-1, 1], half[:2])
    return np.column_stack([plan, [low, high]])


def _above(m: mujoco.MjModel, body: int) -> Iterator[int]:
    """A body and those that carry it."""
    while body:
        yield body
        body = int(m.body_parentid[body])


def _geoms(m: mujoco.MjModel, body: str) -> range:
    first = int(m.body(body).geomadr[0])
    return range(first, first + int(m.body(body).geomnum[0]))


def _shapes(m: mujoco.MjModel, part: int) -> list[int]:
    """The geoms of a part that can collide: its pieces, or what is drawn of it."""
    geoms = [*_geoms(m, m.body(part).name)]
    return [g for g in geoms if m.geom_group[g] == 3] or geoms


def _box(m: mujoco.MjModel, geom: int, at: Boxes, turn: Boxes) -> Boxes:
    middle, half = at + turn @ m.geom_aabb[geom][:3], np.abs(turn) @ m.geom_aabb[geom][3:]
    return np.array([middle - half, middle + half])


def _turn(quaternion: Boxes) -> Boxes:
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


def _near(one: tuple[list[str], Boxes], other: tuple[list[str], Boxes]) -> tuple[str, str] | None:
    """The geoms of two machines that come nearest, where they are near."""
    (mine, a), (its, b) = one, other
    apart = np.maximum(a[:, None, 0] - b[None, :, 1], b[None, :, 0] - a[:, None, 1]).max(axis=2)
    if not apart.size or apart.min() > NEAREST:
        return None
    i, j = np.unravel_index(int(apart.argmin()), apart.shape)
    return mine[i], its[j]
