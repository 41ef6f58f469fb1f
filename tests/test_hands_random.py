"""Hands on random products: blocks, cylinders and balls, each beside or on one that is there."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from factory.pipeline import read
from factory.simulation.request import RunRequest
from factory.simulation.simulation import Simulation
from factory.simulation.watched import watched
from factory.study.fidelity.hidden import HiddenPenetrations

AT_MOST_MM, GRIP_MM = 0.1, 0.5
"""How deep anything that is drawn may be in anything, and how far a grip may be."""

TRIES = 200
"""So often it is tried to find room for a part."""

Extent = tuple[list[float], list[float]]
"""A box from its low to its high corner [m]."""


def random_blocks(seed: int) -> str:
    """A product of 3 to 9 parts that are joined in twos, in a tree, all at once, or any how."""
    rng, boxes, lines = random.Random(seed), list[Extent](), list[str]()
    for _ in range(rng.randint(3, 9)):
        for _ in range(TRIES):
            shape, size = _shape(rng)
            low = _beside(rng, size, boxes)
            box = low, [low[k] + size[k] for k in range(3)]
            if all(_apart(box, other) for other in boxes):
                at = ", ".join(f"{(box[0][k] + box[1][k]) / 2:.5f}" for k in range(3))
                lines.append(f"p{len(boxes)} = atomic ( {shape}, pos = ( {at} ) );")
                boxes.append(box)
                break
    names, made = [f"p{n}" for n in range(len(boxes))], list[str]()
    style = rng.choice(["chain", "tree", "wide", "mixed"])
    while len(names) > 1:
        count = {"chain": 2, "tree": 2, "wide": len(names)}.get(style, rng.randint(2, 4))
        count = min(count, len(names))
        first = 0 if style == "chain" else rng.randrange(len(names) - count + 1)
        joined, made_of = names[first : first + count], f"s{len(made) + 1}"
        if rng.random() < 0.3:
            joined.reverse()
        made.append(f"{made_of} = mate ( {', '.join(joined)} );")
        names[first : first + count] = [made_of]
    return "\n".join([f"root = {names[0]};", *made, *lines]) + "\n"


def _shape(rng: random.Random) -> tuple[str, list[float]]:
    """A shape in the language of PAGs, and its size [m]."""
    kind = rng.choice(["box", "box", "box", "cylinder", "sphere"])
    if kind == "box":
        size = [rng.choice([0.01, 0.02, 0.03, 0.04, 0.06, 0.1]) for _ in range(3)]
        return f"box = ( {size[0]}, {size[1]}, {size[2]} )", size
    if kind == "cylinder":
        radius, height = rng.choice([0.005, 0.01, 0.02]), rng.choice([0.02, 0.04, 0.06])
        return f"cylinder = ( {radius}, {height} )", [2 * radius, 2 * radius, height]
    wide = rng.choice([0.02, 0.03])
    return f"sphere = {wide / 2}", [wide] * 3


def _beside(rng: random.Random, size: list[float], boxes: list[Extent]) -> list[float]:
    """Where a part of a size begins: beside or on one of those that are there."""
    if not boxes:
        return [-size[0] / 2, -size[1] / 2, 0.0]
    (low, high), gap = rng.choice(boxes), rng.choice([0.0005, 0.001])
    begin = [
        low[k] + round(rng.uniform(-0.3, 0.8) * max(high[k] - low[k] - 0.3 * size[k], 0.005), 3)
        for k in range(2)
    ]
    begin.append(low[2])
    axis, ahead = rng.choice([(0, True), (0, False), (1, True), (1, False), *[(2, True)] * 3])
    begin[axis] = high[axis] + gap if ahead else low[axis] - size[axis] - gap
    return begin


def _apart(one: Extent, other: Extent) -> bool:
    return any(one[0][k] >= other[1][k] - 1e-9 or one[1][k] <= other[0][k] + 1e-9 for k in range(3))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(60))
def test_hands_hold_and_meet_nothing(seed: int, tmp_path: Path) -> None:
    file = tmp_path / "product.pag"
    file.write_text(random_blocks(seed))
    layout = read(file).layout
    simulation = Simulation(layout, RunRequest(units=3, jitter=0.3))
    hidden = HiddenPenetrations.of(simulation)
    run = watched(simulation, [lambda world, _: hidden.look(world.d.qpos, world.time)], 150.0)
    assert run.succeeded, run.verdict.failures
    assert run.physics is not None
    assert (run.physics.grip_gap_max_mm or 0.0) < GRIP_MM
    assert (run.physics.grip_strength_share_max or 0.0) < 1
    deep = hidden.found()
    assert max((p.depth_mm for p in deep), default=0.0) < AT_MOST_MM
