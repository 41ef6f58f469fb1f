"""factory: compile a product assembly graph into a factory that is proved live and runs in MuJoCo.

The main job is four calls:

>>> import factory
>>> pag = factory.load_pag("examples/paper.pag")
>>> plan = factory.compile(pag)
>>> [robot.name for robot in plan.robots]
['r1', 'r2', 'r3', 'r4', 'r5', 'r6']
>>> layout = factory.lay_out(plan)
>>> run = factory.run(layout, world="ideal", units=3)
>>> run.products, run.refines_net
(3, True)

With `world="mujoco"`, the default, the same net runs over rigid-body physics.
`factory.verify(plan)` proves that the net is a gear net, live, safe and reversible.
"""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from factory.support.errors import Diagnostic, FactoryError, InputError, MissingError, RunError
from factory.support.settings import Settings
from factory.support.version import __version__ as __version__

if TYPE_CHECKING:
    import networkx as nx

    from factory.layout.layout import Layout
    from factory.nets.verdict import Verdict
    from factory.plant.factory import Factory
    from factory.problem.pag import PAG
    from factory.simulation.run import Run


__all__ = [
    "Diagnostic",
    "FactoryError",
    "InputError",
    "MissingError",
    "RunError",
    "Settings",
    "compile",
    "lay_out",
    "load_pag",
    "run",
    "to_networkx",
    "verify",
]


def load_pag(path: str | PathLike[str], templates: Sequence[Path] = ()) -> PAG:
    """The product assembly graph in a file.

    `templates`: folders with further operations, searched before the shipped ones. Raises
    InputError with every error of the file.
    """
    from factory.pipeline import read

    return read(path, templates).pag


def compile(
    pag: PAG,
    templates: Sequence[Path] = (),
    robots: int | Literal["least"] | None = None,
    cycle: float | None = None,
) -> Factory:
    """The factory (R, ~, N) that makes a product (paper, section 5); with at most so many `robots`,
    or with few for a `cycle` time [s], where these are given. Raises InputError."""
    from factory.pipeline import Project, all_templates
    from factory.study.allocation.aim import Aim
    from factory.study.allocation.search import allocated

    return allocated(Project(pag, all_templates(templates)), Aim(robots, cycle)).plain


def verify(plan: Factory) -> Verdict:
    """The proof that a factory's net is a gear net, live, safe, reversible and legally marked, or
    witnesses of what fails."""
    from factory.nets.verify import verify as prove

    return prove(plan.net)


def to_networkx(subject: PAG | Factory) -> nx.DiGraph:
    """The assembly tree of a PAG, or the net of a factory, as a digraph of networkx.

    Nodes of a tree are labels, with `kind` (`part` or `assembly`), `operation` and `source`. Nodes
    of a net are places p0, p1, ... and transitions t0, t1, ..., with `kind`, `name` and `source`;
    places also with `mode`, `label`, `size`, `tokens` and `robots`.

    >>> import factory, networkx
    >>> pag = factory.load_pag("examples/paper.pag")
    >>> sorted(networkx.ancestors(factory.to_networkx(pag), "sub2"))
    ['part1', 'part2', 'sub1']
    >>> net = factory.to_networkx(factory.compile(pag))
    >>> [net.nodes[p]["name"] for p in net.predecessors("t0")]
    ['r1:nopart', 'r2:part3', 'r3:sub2']
    """
    from factory.plant.graphs import to_networkx as graph_of

    return graph_of(subject)


def lay_out(
    plan: Factory,
    clearance: float = 0.02,
    floor: tuple[float, float] | None = None,
    relay: bool = False,
    cycle: float | None = None,
) -> Layout:
    """The stretched tree of guidepaths (paper, section 5.1), sized by the parts' real geometry.

    `clearance` and `floor` (width, depth) in [m]. `relay`: several robots share guidepaths that
    set the pace, to reach a `cycle` time [s] or the least there can be; the layout's factory has
    more robots then. Raises InputError for a mesh that cannot be read,
    RunError where the factory does not fit the floor.
    """
    from factory.geometry.product import product_geometry
    from factory.layout.request import Ground

    ground = Ground(floor, relay, cycle if relay else None)
    return ground.lay_out(plan, product_geometry(plan.pag), Settings(clearance=clearance))


def run(
    layout: Layout,
    world: Literal["mujoco", "ideal"] = "mujoco",
    units: int = 1,
    seed: int = 0,
    jitter: float = 0.0,
    settings: Settings | None = None,
    max_time: float | None = None,
    **options: Any,
) -> Run:
    """Run the net over a world until `units` products are dropped off.

    `seed` and `jitter` draw each robot's speed and gain within ± jitter; `max_time` [s] of
    simulated time; further options are those of a `RunRequest`. Raises RunError for a run that
    stalls or takes longer, InputError where the engine refuses a mesh.
    """
    from factory.simulation.request import RunRequest
    from factory.simulation.simulation import Simulation, require

    options = {"shown": False, "settings": settings or Settings(), **options}
    request = RunRequest(world, units, seed, jitter, **options)
    return require(Simulation(layout, request).run(max_time=max_time))
