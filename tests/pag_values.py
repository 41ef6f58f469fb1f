"""Random product assembly graphs and templates as values, for tests of what needs no text."""

from __future__ import annotations

import random
from functools import cache

from hypothesis import strategies as st

from factory.floor.robots.catalogue import load_catalogue
from factory.support.errors import Position
from factory.theory.compiler.compiler import compile_pag
from factory.theory.plant.factory import Factory
from factory.theory.problem.pag import PAG, Assembly
from factory.theory.problem.robot_types import Catalogue
from factory.theory.problem.template import Law, Point, Template

_DOT = Template(
    "atomic", ("dot",), 1, (), ("nopart",), ("LAB1",), Law("navigation", (Point("B", 1),))
)
_MATE = Template(
    "mate",
    ("dot", "dot", "dot"),
    3,
    ((Point("A", 1), Point("A", 2), Point("B", 3, -2)),),
    ("LAB1", "LAB2", "nopart"),
    ("nopart", "nopart", "LAB3"),
    Law("navigation", (Point("A", 1, 2), Point("A", 2, 2), Point("B", 3))),
    further="insert",
)
_INSERT = Template(
    "insert",
    ("dot", "dot"),
    1,
    ((Point("S", 1), Point("A", 2)),),
    ("LAB1", "LAB2"),
    ("LAB3", "nopart"),
    Law("navigation", (Point("S", 1, 2), Point("A", 2, 2))),
)
_WELD = Template(
    "weld",
    ("dot", "tool"),
    1,
    ((Point("S", 1), Point("A", 2)),),
    ("LAB1", "nopart"),
    ("LAB2", "nopart"),
    Law("navigation", (Point("S", 1, 2), Point("A", 2, 2)), dwell="dwell"),
    parameters=(("dwell", 1.0),),
)
_CLAMP = Template(
    "clamp",
    ("dot", "tool", "tool"),
    1,
    ((Point("S", 1), Point("A", 2), Point("A", 3)),),
    ("LAB1", "nopart", "nopart"),
    ("LAB2", "nopart", "nopart"),
    Law("navigation", (Point("S", 1), Point("A", 2, 2), Point("A", 3, 2))),
)
_DROPOFF = Template(
    "dropoff", ("dot",), 1, (), ("LAB1",), ("nopart",), Law("navigation", (Point("A", 1, 2),))
)

TEMPLATES = {t.name: t for t in (_DOT, _MATE, _INSERT, _WELD, _CLAMP, _DROPOFF)}


@cache
def catalogue() -> Catalogue:
    """Robots of types dot and tool."""
    types = load_catalogue().types
    return Catalogue({name: types[name] for name in ("dot", "tool")})


def factory_of(pag: PAG) -> Factory:
    """The compiled factory."""
    return compile_pag(pag, TEMPLATES, catalogue())


def paper() -> PAG:
    """The example of section 6."""
    table = [
        ("sub3", "mate", ("sub2", "part3")),
        ("sub2", "weld", ("sub1",)),
        ("sub1", "mate", ("part1", "part2")),
        ("part1", "atomic", ()),
        ("part2", "atomic", ()),
        ("part3", "atomic", ()),
    ]
    return _pag("sub3", table, first_line=3)


def _pag(root: str, table: list[tuple[str, str, tuple[str, ...]]], first_line: int = 1) -> PAG:
    nodes = tuple(
        Assembly(label, operation, inputs, (), Position("test.pag", line, 1, label))
        for line, (label, operation, inputs) in enumerate(table, start=first_line)
    )
    return PAG(root, nodes, file="test.pag")


SHAPES = ("any", "chain", "balanced", "unary", "wide")


def random_pag(size: int, seed: int, shape: str = "any", arity: int = 8) -> PAG:
    """A PAG of about `size` labels, always the same for the same arguments.

    Chains add one part at a time, balanced ones mate equals, unary ones weld most of the time,
    wide ones mate as many as `arity` at once.
    """
    rng = random.Random(f"{size} {seed} {shape} {arity}")
    table: list[tuple[str, str, tuple[str, ...]]] = []
    loose: list[str] = []
    unary = {"unary": 0.8, "any": 0.2}.get(shape, 0.05)

    def add(operation: str, inputs: tuple[str, ...]) -> str:
        label = f"{'x' if inputs else 'p'}{len(table)}"
        table.append((label, operation, inputs))
        return label

    if shape == "chain":
        pile = add("atomic", ())
        while len(table) + 2 <= size:
            if rng.random() < unary:
                pile = add("weld", (pile,))
            else:
                inputs = [pile, add("atomic", ())]
                rng.shuffle(inputs)
                pile = add("mate", tuple(inputs))
        return _pag(pile, table)
    parts = max(1, int(size * (1 - unary) / 2) if shape != "wide" else int(size * 0.75))
    loose = [add("atomic", ()) for _ in range(parts)]
    spare = max(0, size - 2 * parts + 1)
    head = 0
    while len(loose) - head > 1 or spare:
        if spare and (len(loose) - head == 1 or rng.random() < unary):
            spare -= 1
            at = rng.randrange(head, len(loose))
            loose[at] = add(rng.choice(("weld", "clamp")), (loose[at],))
            continue
        if len(loose) - head == 1:
            break
        most = min(arity if shape == "wide" else rng.choice((2, 2, 2, 3, arity)), len(loose) - head)
        count = 2 if shape == "balanced" else rng.randint(2, max(2, most))
        taken = loose[head : head + count]
        head += count
        if shape == "any":
            rng.shuffle(taken)
        loose.append(add("mate", tuple(taken)))
    return _pag(loose[-1], table)


@st.composite
def pags(draw: st.DrawFn, most: int = 40) -> PAG:
    """PAGs of all shapes with up to about `most` labels; small ones are simple."""
    size = draw(st.integers(1, most))
    shape = draw(st.sampled_from(SHAPES))
    return random_pag(size, draw(st.integers(0, 10_000)), shape, draw(st.integers(2, 8)))


def factories(most: int = 40) -> st.SearchStrategy[Factory]:
    """Compiled random PAGs."""
    return pags(most).map(factory_of)
