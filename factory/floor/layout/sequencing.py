"""The sequence of the products of a mix: the one with the shortest cycle time, by estimate.

Every sequence is live (`compiler.mixing`), and their cycle times differ: robots that one product
needs long wait for others that another product needs long. They are compared before there is a
layout, with the least time of each operation in any layout (`bounds`).
"""

from __future__ import annotations

from itertools import islice

from factory.floor.geometry.solids import Product
from factory.floor.layout.bounds import least_times
from factory.floor.layout.durations import Pace
from factory.support.settings import Settings
from factory.theory.compiler.assigning import shared
from factory.theory.compiler.mixing import lines_of_mix, orders, turns_of
from factory.theory.nets.ways import train_ratio
from factory.theory.plant.factory import Factory
from factory.theory.problem.pag import Mix
from factory.theory.problem.plan import Plan
from factory.theory.problem.robot_types import Catalogue

MOST, SAME = 100, 1e-6
"""The most sequences that are compared; ratios that differ by less are equal."""


def sequenced(
    forest: Factory, mix: Mix, product: Product, catalogue: Catalogue, settings: Settings
) -> Plan:
    """The plan of a mix with the best sequence, whose products are made by a forest of factories.
    Where the estimates of sequences are equal, the even one is taken. Raises InputError
    (BadLine)."""
    on, times = lines_of_mix(forest, catalogue), dict[tuple[str, str], float]()
    sequences = islice(orders(mix), MOST)
    plans = [forest.plan.then(turns_of(forest, on, sequence)) for sequence in sequences]
    if len(plans) == 1:
        return plans[0]
    seconds = list[float]()
    for plan in plans:
        factory = shared(forest, plan, catalogue)
        made = factory.sequence
        if not times:
            solids, pace = product.repeated(factory), Pace.of(settings)
            least = least_times(factory, solids, settings.clearance, pace)
            for o, time in zip(factory.operations, least, strict=True):
                times.setdefault((made[o.turn], o.written), time)
        each = [times[made[o.turn], o.written] for o in factory.operations]
        idle = [0.0] * (len(factory.net.threaded.places) - len(each))
        seconds.append(train_ratio(factory.net, [*each, *idle], {})[0].seconds)
    best = min(seconds) + SAME
    return next(plan for plan, ratio in zip(plans, seconds, strict=True) if ratio <= best)
