"""Random folds as values, and what is wrong with others, for tests."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from itertools import combinations

from factory.apps.few_robots.folding import Line, fold, folded, line_of, mismatch
from factory.apps.few_robots.parallel import in_parallel
from factory.floor.layout.durations import Pace
from factory.floor.layout.embedding import lay_out
from factory.floor.layout.layout import Layout
from factory.floor.mating.mating import judged
from factory.floor.robots.catalogue import load_catalogue
from factory.pipeline import Project
from factory.support.settings import Settings
from factory.theory.compiler.assigning import gear_net, shared
from factory.theory.compiler.compiler import compile_pag
from factory.theory.lang.template_reader import all_templates
from factory.theory.nets.gears import GearNet
from factory.theory.nets.marked import MarkedNet
from factory.theory.plant.approaches import Approach
from factory.theory.plant.factory import Factory
from factory.theory.problem.pag import PAG
from factory.theory.problem.plan import Plan
from factory.theory.problem.robot_types import Catalogue
from tests.pag_values import SHAPES, TEMPLATES, catalogue, paper, random_pag
from tests.token_game import dates

INSERTING = {**TEMPLATES, "insert": replace(TEMPLATES["insert"], further="insert")}
"""Templates by which all inputs but the first are inserted."""


def inserted(pag: PAG, share: float = 1.0, seed: int = 0) -> PAG:
    """The PAG with so great a share of its mates as inserts."""
    rng = random.Random(seed)
    nodes = (
        replace(node, operation="insert")
        if node.operation == "mate" and rng.random() < share
        else node
        for node in pag.nodes
    )
    return replace(pag, nodes=tuple(nodes))


def plain(pag: PAG) -> Factory:
    """The factory with one tour a robot."""
    return compile_pag(pag, INSERTING, catalogue())


def three_robots() -> Factory:
    """The paper's example with inserts; one robot brings part2 and part3."""
    factory = plain(inserted(paper()))
    lines = ((robot_of(factory, "part2"), robot_of(factory, "part3")),)
    return folded(factory, lines, catalogue())


def branched(factory: Factory, *branches: tuple[str, int]) -> Factory:
    """A factory, perhaps a fold, with branches that are there several times."""
    base = replace(factory, plan=Plan())
    return shared(base, in_parallel(base, branches), catalogue())


def robot_of(factory: Factory, label: str) -> int:
    """The robot that brings a label to another."""
    brings = (
        robot
        for o in factory.operations
        for robot, brought in zip(o.robots, o.before, strict=True)
        if brought == label and robot != o.carrier
    )
    return next(brings)


def random_lines(factory: Factory, rng: random.Random) -> list[Line]:
    """A random fold: the definition, from the output robot's line on. Tours on one line deliver to
    one line, in different operations, and one type of robot is fit for them."""
    kids: dict[int, list[int]] = {robot.index: [] for robot in factory.robots}
    for robot in factory.robots[1:]:
        kids[factory.last(robot.index).carrier].append(robot.index)
    lines: list[Line] = [(0,)]
    apart = rng.choice((0.0, 0.1, 0.4))
    for line in lines:
        groups: list[list[int]] = []
        below = [kid for tour in line for kid in kids[tour]]
        rng.shuffle(below)
        for kid in below:
            fitting = [group for group in groups if _fits(factory, group, kid)]
            if fitting and rng.random() >= apart:
                rng.choice(fitting).append(kid)
            else:
                groups.append([kid])
        lines += [tuple(sorted(group)) for group in groups]
    return lines


def _fits(factory: Factory, group: list[int], kid: int) -> bool:
    robots = factory.robots
    return all(
        catalogue().meet(robots[other].type, robots[kid].type) is not None
        and factory.last(other).index != factory.last(kid).index
        for other in group
    )


def random_fold(seed: int, size: int = 30) -> Factory:
    """A random fold of a random PAG of up to so many labels, always the same."""
    rng = random.Random(seed)
    shape, count = rng.choice(SHAPES), rng.randint(1, size)
    pag = random_pag(count, seed, shape, rng.randint(2, 5))
    factory = plain(inserted(pag, rng.choice((0.0, 0.5, 1.0)), seed))
    return folded(factory, random_lines(factory, rng), catalogue())


def table_of(table: Sequence[tuple[str, str, tuple[str, ...]]]) -> PAG:
    """A PAG of labels with their operations and inputs, the product first."""
    node = paper().nodes[0]
    nodes = (replace(node, label=x, operation=o, inputs=i) for x, o, i in table)
    return replace(paper(), root=table[0][0], nodes=tuple(nodes))


@cache
def fold_layout(seed: int, settings: Settings) -> Layout:
    """A layout of a random PAG with inserts, many of whose robots share lines."""
    rng = random.Random(seed)
    shape = rng.choice(("any", "chain", "balanced", "unary"))
    pag = inserted(random_pag(rng.randint(5, 14), seed, shape, 3))
    nodes = (replace(n, operation="weld") if n.operation == "clamp" else n for n in pag.nodes)
    pag = replace(pag, nodes=tuple(nodes))
    shipped = all_templates()
    templates = {**shipped, "insert": replace(shipped["insert"], further="insert")}
    project = Project(pag, templates, load_catalogue(), settings)
    factory, known = judged(project.compiled, project.product), project.catalogue
    lines = lines_of_one_side(factory, known, rng)
    made = shared(factory, fold(factory, lines, known), known)
    return lay_out(made, project.product, pace=Pace.of(settings))


def lines_of_one_side(factory: Factory, known: Catalogue, rng: random.Random) -> list[Line]:
    """Random lines of tours that can share a robot, each as full as can be but for one in five."""
    lines: list[Line] = [(0,)]
    for line in lines:
        groups: list[list[int]] = []
        below = (r.index for r in factory.robots[1:] if factory.last(r.index).carrier in line)
        for kid in below:
            on = line_of(len(factory.robots), lines)
            fitting = (group for group in groups if _shares(factory, group, kid, on, known))
            group = next(fitting, None)
            if group is None or rng.random() < 0.2:
                groups.append([kid])
            else:
                group.append(kid)
        lines += [tuple(sorted(group)) for group in groups]
    return lines


def with_sides(factory: Factory, rng: random.Random) -> Factory:
    """The factory in which what comes together does so from one side, the other, or both."""
    sides = ((-1,), (+1,), (-1, +1))
    operations = (
        replace(o, approach=Approach("slide", 0, rng.choice(sides))) if len(o.inputs) > 1 else o
        for o in factory.operations
    )
    return replace(factory, operations=tuple(operations))


def _shares(
    factory: Factory, group: list[int], kid: int, on: Sequence[int], known: Catalogue
) -> bool:
    sides = (factory.sides(robot) for robot in (*group, kid))
    return bool(set.intersection(*sides)) and all(
        not mismatch(factory, other, kid, on, known)
        and factory.last(other).index != factory.last(kid).index
        for other in group
    )


def swapped(factory: Factory, robot: int, one: int, other: int) -> GearNet:
    """The net with two tours of a robot exchanged."""
    tours = list(factory.tours[robot])
    tours[one], tours[other] = tours[other], tours[one]
    robots = list(factory.robots)
    robots[robot] = replace(robots[robot], operations=tuple(n for tour in tours for n in tour))
    return gear_net(tuple(robots), factory.operations)


def pairs_of_tours(factory: Factory) -> Iterator[tuple[int, int, int]]:
    """Every robot with every two of its tours."""
    for robot, tours in enumerate(factory.tours):
        for one, other in combinations(range(len(tours)), 2):
            yield robot, one, other


def simulated_cycle(net: GearNet, seconds: list[float], rounds: int = 60) -> float:
    """The mean time between two products in the long run, by the token game. Exact where the number
    of rounds is a multiple of the period."""
    fired = dates(MarkedNet.of(net), seconds, 3 * rounds)
    return max(row[-1] - row[-1 - rounds] for row in fired) / rounds
