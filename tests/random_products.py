"""Random products: default boxes in any tree, or blocks, cylinders and balls that touch."""

from __future__ import annotations

import random

TRIES = 200
"""So often it is tried to find room for a part."""

MOST = 40
"""Most parts of a product."""

SHAPES = ("box", "box", "box", "cylinder", "sphere")
"""The shapes of parts, with how often each comes."""

TOOLS = ("weld", "press", "glue", "inspect")
"""Operations in which a tool works on one sub-assembly."""

Extent = tuple[list[float], list[float]]
"""A box from its low to its high corner [m]."""


def random_product(seed: int) -> str:
    """A product of 2 to 40 parts, most of them of few: default boxes, or shapes that touch; joined
    in any way."""
    rng = random.Random(seed)
    count = min(MOST, 2 + int(rng.expovariate(1 / 8)))
    if rng.random() < 0.4:
        parts = [f"p{n} = atomic ();" for n in range(count)]
    else:
        shapes = rng.choice([SHAPES, ("box",)])
        parts = _touching(rng, count, (0.0, 0.0, 0.0005, 0.001), shapes)
    return _joined(rng, parts, rng.choice([0.0, 0.15, 0.4]), rng.choice([0.0, 0.3]))


def random_blocks(seed: int) -> str:
    """A product of 3 to 9 shapes that are joined in twos, in a tree, all at once, or any how."""
    rng = random.Random(seed)
    return _joined(rng, _touching(rng, rng.randint(3, 9), (0.0005, 0.001)))


def _touching(
    rng: random.Random, count: int, gaps: tuple[float, ...], shapes: tuple[str, ...] = SHAPES
) -> list[str]:
    """Definitions of parts, each of which lies beside or on another, with one of some gaps [m]."""
    boxes, lines = list[Extent](), list[str]()
    for _ in range(count):
        for _ in range(TRIES):
            shape, size = _shape(rng, shapes)
            low = _beside(rng, size, boxes, gaps)
            box = low, [low[k] + size[k] for k in range(3)]
            if all(_apart(box, other) for other in boxes):
                at = ", ".join(f"{(box[0][k] + box[1][k]) / 2:.5f}" for k in range(3))
                lines.append(f"p{len(boxes)} = atomic ( {shape}, pos = ( {at} ) );")
                boxes.append(box)
                break
    return lines


def _joined(rng: random.Random, parts: list[str], tools: float = 0.0, inserted: float = 0.0) -> str:
    """A product of such parts, in the language of PAGs. Of what is joined a tool works on some
    share, and some share of twos are inserted."""
    names, made = [f"p{n}" for n in range(len(parts))], list[str]()
    style = rng.choice(["chain", "tree", "balanced", "wide", "mixed"])
    while len(names) > 1:
        count = {"wide": len(names), "mixed": rng.randint(2, 4)}.get(style, 2)
        count = min(count, len(names))
        first = 0 if style == "chain" else rng.randrange(len(names) - count + 1)
        first = 0 if style == "balanced" else first
        joined, made_of = names[first : first + count], f"s{len(made) + 1}"
        if rng.random() < 0.3:
            joined.reverse()
        operation = "insert" if count == 2 and rng.random() < inserted else "mate"
        made.append(f"{made_of} = {operation} ( {', '.join(joined)} );")
        if rng.random() < tools:
            made.append(f"{made_of}t = {rng.choice(TOOLS)} ( {made_of}, dwell = 0.2 );")
            made_of += "t"
        del names[first : first + count]
        names.insert(len(names) if style == "balanced" else first, made_of)
    return "\n".join([f"root = {names[0]};", *made, *parts]) + "\n"


def _shape(rng: random.Random, shapes: tuple[str, ...]) -> tuple[str, list[float]]:
    """A shape in the language of PAGs, and its size [m]."""
    kind = rng.choice(shapes)
    if kind == "box":
        size = [rng.choice([0.01, 0.02, 0.03, 0.04, 0.06, 0.1]) for _ in range(3)]
        return f"box = ( {size[0]}, {size[1]}, {size[2]} )", size
    if kind == "cylinder":
        radius, height = rng.choice([0.005, 0.01, 0.02]), rng.choice([0.02, 0.04, 0.06])
        return f"cylinder = ( {radius}, {height} )", [2 * radius, 2 * radius, height]
    wide = rng.choice([0.02, 0.03])
    return f"sphere = {wide / 2}", [wide] * 3


def _beside(
    rng: random.Random, size: list[float], boxes: list[Extent], gaps: tuple[float, ...]
) -> list[float]:
    """Where a part of a size begins: beside or on one of those that are there."""
    if not boxes:
        return [-size[0] / 2, -size[1] / 2, 0.0]
    (low, high), gap = rng.choice(boxes), rng.choice(gaps)
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
