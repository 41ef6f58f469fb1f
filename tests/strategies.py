"""Random values for tests: PAGs, templates, broken texts."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

from factory.support.settings import DWELL
from factory.theory.problem.pag import PAG, RESERVED, Assembly, Parameter, Value
from factory.theory.problem.template import Failure, Law, Point, Response, Template, Test

LABEL_LETTERS = "abzAZ0189_-.äßλД中é"
UNARY = ("weld", "inspect", "press", "glue")
SHAPES = ("mixed", "chain", "balanced", "unary")

labels = st.text(LABEL_LETTERS, min_size=1, max_size=6).filter(lambda x: x not in RESERVED)
numbers = st.floats(allow_nan=False, allow_infinity=False, min_value=-1e6, max_value=1e6)
extents = st.floats(min_value=1e-9, max_value=1e6, allow_subnormal=False)
shares = st.floats(min_value=0.0, max_value=1.0)
quaternions = st.tuples(*[numbers] * 4).filter(lambda q: any(abs(x) > 1e-9 for x in q))


def _geometry(meshes: tuple[str, ...]) -> st.SearchStrategy[list[tuple[str, Value]]]:
    """Keyword arguments of a part; at most one shape."""
    shapes: list[st.SearchStrategy[list[tuple[str, Value]]]] = [
        st.just([]),
        st.tuples(*[extents] * 3).map(lambda v: [("box", v)]),
        st.tuples(*[extents] * 2).map(lambda v: [("cylinder", v)]),
        extents.map(lambda v: [("sphere", v)]),
    ]
    if meshes:
        shapes.append(st.sampled_from(meshes).map(lambda v: [("mesh", v)]))
    others: dict[str, st.SearchStrategy[Value]] = {
        "scale": extents,
        "pos": st.tuples(*[numbers] * 3),
        "quat": quaternions,
        "density": extents,
        "mass": extents,
        "rgba": st.tuples(*[shares] * 4),
    }
    chosen = st.fixed_dictionaries({}, optional=others).map(lambda found: list(found.items()))
    return st.tuples(st.one_of(shapes), chosen).flatmap(
        lambda pair: st.permutations([*pair[0], *pair[1]])
    )


@st.composite
def _operation(draw: st.DrawFn, arity: int) -> tuple[str, tuple[Parameter, ...]]:
    """An operation that takes so many inputs, and its parameters."""
    if arity != 1:
        return draw(st.sampled_from(["mate", "insert"] if arity == 2 else ["mate"])), ()
    dwell = draw(st.none() | st.floats(min_value=0.0, max_value=100.0))
    parameters = () if dwell is None else (Parameter("dwell", dwell),)
    return draw(st.sampled_from(UNARY)), parameters


def _arity(draw: st.DrawFn, shape: str, pool: int) -> int:
    """How many of the pool's sub-assemblies the next operation takes."""
    if shape == "unary" and draw(st.integers(0, 3)):
        return 1
    if shape in ("chain", "balanced"):
        return min(2, pool)
    return draw(st.integers(1, min(8, pool)))


@st.composite
def pags(draw: st.DrawFn, max_labels: int = 20, meshes: tuple[str, ...] = ()) -> PAG:
    """A PAG of up to `max_labels` labels: chains, balanced trees, runs of unary operations, trees
    of arity up to 8; its nodes in any order, the parts with or without geometry.

    `meshes` are paths of mesh files that exist in the folder the text will be read for.
    """
    names = draw(st.lists(labels, min_size=1, max_size=max_labels, unique=True))
    shape = draw(st.sampled_from(SHAPES))
    parts = len(names) if shape == "mixed" else (len(names) + 1) // 2
    parts = draw(st.integers(1, parts))
    nodes = [_part(draw, name, meshes) for name in names[:parts]]
    pool = names[:parts]
    for name in names[parts:]:
        arity = _arity(draw, shape, len(pool))
        inputs = pool[-arity:] if shape == "chain" else pool[:arity]
        pool = pool[:-arity] if shape == "chain" else pool[arity:]
        nodes.append(_made(draw, name, inputs))
        pool.append(name)
    if len(pool) > 1:
        top = "the-product-itself"
        nodes.append(Assembly(top, "mate", tuple(pool)))
        pool = [top]
    nodes = draw(st.permutations(nodes)) if draw(st.booleans()) else nodes
    count = draw(st.sampled_from([None, len(nodes)]))
    return PAG(pool[0], tuple(nodes), count)


def _part(draw: st.DrawFn, name: str, meshes: tuple[str, ...]) -> Assembly:
    geometry = draw(_geometry(meshes)) if draw(st.booleans()) else []
    return Assembly(name, "atomic", (), tuple(Parameter(key, value) for key, value in geometry))


def _made(draw: st.DrawFn, name: str, inputs: list[str]) -> Assembly:
    operation, parameters = draw(_operation(len(inputs)))
    return Assembly(name, operation, tuple(inputs), parameters)


values: st.SearchStrategy[Value] = st.one_of(
    numbers,
    st.text(st.characters(codec="utf-8", exclude_characters="\n\r"), max_size=8),
    st.lists(numbers, min_size=2, max_size=4).map(tuple),
)


@st.composite
def _points(draw: st.DrawFn, robots: int) -> Point:
    multiple = draw(st.sampled_from([0.0, 1.0, -1.0, 2.0, -2.0, 0.5]) | numbers)
    return Point(draw(st.sampled_from("ABS")), draw(st.integers(1, robots)), multiple)


@st.composite
def templates(draw: st.DrawFn) -> Template:
    """A template that is right by construction."""
    k = draw(st.integers(1, 6))
    j = draw(st.integers(1, k))
    brings = draw(st.lists(st.booleans(), min_size=k, max_size=k))
    order = iter(draw(st.permutations(range(1, sum(brings) + 1))))
    before = tuple(f"LAB{next(order)}" if bring else "nopart" for bring in brings)
    result = f"LAB{sum(brings) + draw(st.integers(1, 3))}"
    defaults: dict[str, Any] = draw(st.dictionaries(labels, values, max_size=3))
    geometry = not any(brings) and draw(st.booleans())
    times = [name for name, value in defaults.items() if _is_time(name, value)]
    radii: list[float | str] = ["eps", 0.001]
    dwells: list[float | str | None] = [None, 0.0, 1.5, *times]
    law = Law(
        draw(labels),
        tuple(draw(_points(k)) for _ in range(k)),
        draw(st.sampled_from(radii)),
        draw(st.sampled_from(dwells)),
    )
    classes = st.lists(_points(k), min_size=2, max_size=4).map(tuple)
    spare = sum(brings) == 2 and not brings[j - 1]
    return Template(
        draw(labels),
        tuple(draw(st.lists(labels, min_size=k, max_size=k))),
        j,
        tuple(draw(st.lists(classes, max_size=3))),
        before,
        tuple(result if i == j else "nopart" for i in range(1, k + 1)),
        law,
        draw(st.sampled_from(["", "insert"])) if any(brings) else "",
        draw(st.sampled_from(["", "insert"])) if spare else "",
        tuple(defaults.items()),
        geometry,
        draw(_failures(any(brings), any(b == "nopart" for b in before[: j - 1] + before[j:]))),
        brought=draw(st.sampled_from(["", "pick"])) if sum(brings) > brings[j - 1] else "",
    )


@st.composite
def _failures(draw: st.DrawFn, takes: bool, tools: bool) -> tuple[Failure, ...]:
    """Failures of a template that takes sub-assemblies or none, with tools or without."""
    again = st.integers(1, 1000).map(lambda times: Response("again", times))
    found = []
    tests: list[Test] = ["lost", "residual", "jammed"]
    tests += [] if takes else ["misplaced"]
    tests += ["rejected"] if tools else []
    for test in draw(st.permutations(tests))[: draw(st.integers(0, 3))]:
        scrapped = st.just(Response("stop" if test == "jammed" and not takes else "scrap"))
        first = [] if test == "lost" and takes else draw(st.lists(again, max_size=1))
        last = draw(scrapped | st.just(Response("stop")))
        limit = draw(st.floats(1e-9, 1)) if test in ("residual", "misplaced") else None
        found.append(Failure(test, limit, (*first, last)))
    return tuple(found)


def _is_time(name: str, value: Value) -> bool:
    return isinstance(value, float) and 0 <= value <= DWELL and not name[-1].isdigit()
