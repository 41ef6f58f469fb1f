"""The options of a run as values, for the command line and for functions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from factory.api import Diagnostic, InputError, Settings, WorldName
from factory.support.errors import usage_error

if TYPE_CHECKING:
    from factory.api import Factory, Layout, Marking, Product, Project, RunRequest

APART = (
    (
        "--relay",
        ("--robots", "--parallel", "[lines]"),
        "a relay divides the way of one tour, and such a robot has several tours",
    ),
    ("[tees]", ("--robots", "--cycle", "--relay"), "they change the robots that share a stem"),
    (
        "--demand",
        ("--distributed", "--from"),
        "only a central supervisor that starts at the beginning can skip units without orders",
    ),
    (
        "--distributed",
        ("--faults", "--spares"),
        "robots that run their own programs do not recover",
    ),
    ("--platen", ("--relay", "--cycle"), "relays need straight guidepaths"),
    *(
        (arms, options, reason)
        for arms in ("--arm", "[arms]")
        for options, reason in (
            (
                ("--relay", "--robots", "--parallel", "--platen", "[lines]", "[tees]"),
                "a cell has one carrier and its arms",
            ),
            (("--floor",), "a cell is as large as its arm"),
        )
    ),
    ("[arms]", ("--cycle",), "the table says how many arms there are"),
)
"""Options that exclude others, with the reason. All other pairs can be combined; of a product,
--relay goes with none of a mix, and with no plan whose robots have several tours (`Project`)."""


def check_together(values: Mapping[str, bool]) -> None:
    """Raises InputError (BadValue) for options that exclude each other."""
    for one, others, reason in APART:
        for other in others:
            if values.get(one) and values.get(other):
                message = f"{one} cannot be combined with {other}: {reason}"
                raise InputError(Diagnostic("BadValue", message, None, "leave out one of the two"))


@dataclass(frozen=True, slots=True)
class RunOptions:
    """The options of a run.

    Attributes:
        world: the world.
        units: number of units to make.
        seed: seed of all random draws.
        jitter: each robot's speed and gain are drawn within ± this share.
        wip: most copies of each part inside; None for no bound.
        start: a legal marking, or the names of its places, separated by commas; None for m₀.
        fuse: whether parts joined for good become one body; None for where that pays.
        max_time: simulated time after which the run is stopped [s].
        distributed: whether robots run their own programs.
        lenient: whether the verdict on its bodies is left out.
        faults: a file of deviations.
        spares: number of spare robots.
        swap: time to replace a dead robot [s].
        demand: a file of the orders for a mix, or a seed that draws them.
        strict: whether a run fails whose success is qualified.

    Raises InputError (Usage) with every value out of its bounds.
    """

    world: WorldName = "mujoco"
    units: int = 1
    seed: int = 0
    jitter: float = 0.0
    wip: int | None = None
    start: str | Marking | None = None
    fuse: bool | None = None
    max_time: float | None = None
    distributed: bool = False
    lenient: bool = False
    faults: Path | None = None
    spares: int = 0
    swap: float | None = None
    demand: str | None = None
    strict: bool = False

    def __post_init__(self) -> None:
        names = ("world", "units", "seed", "jitter", "wip", "max_time", "spares", "swap")
        Settings.check_values({name: getattr(self, name) for name in names})

    @property
    def recovers(self) -> bool:
        """Whether the run recovers from failures."""
        return self.faults is not None or self.spares > 0

    def check_combination(self) -> None:
        """Raises InputError (BadValue) where options of the run do not go together. Nothing is laid
        out for that."""
        check_together(
            {
                "--demand": self.demand is not None,
                "--from": self.start is not None,
                "--distributed": self.distributed,
                "--faults": self.faults is not None,
                "--spares": self.spares > 0,
            }
        )

    def check(self, project: Project) -> None:
        """The same, before a project is laid out; the file of a demand is read, but for a pipe,
        which is read once. Raises InputError."""
        from factory.apps.runs.demand_file import demand_of

        self.check_combination()
        if self.demand is not None and not Path(self.demand).is_fifo():
            demand_of(self.demand, project.pag, self.units)

    def request(self, project: Project, shown: bool = True) -> RunRequest:
        """The request of a run; `shown`: whether it is filmed or logged. Raises InputError."""
        from factory.api import RunRequest
        from factory.apps.runs.demand_file import demand_of
        from factory.apps.runs.start import legal_marking

        self.check_combination()
        layout, start, units, demand = project.layout, self.start, self.units, None
        if self.demand is not None:
            demand = demand_of(self.demand, project.pag, units)
            units = len(demand.orders) or units
        if isinstance(start, str):
            start = legal_marking(layout.factory.net, start)
        return RunRequest(
            self.world,
            units,
            self.seed,
            self.jitter,
            project.settings,
            start,
            self.wip,
            self.distributed,
            self._fuses(layout),
            shown,
            recovers=self.recovers,
            catalogue=project.catalogue,
            demand=demand,
        )

    def _fuses(self, layout: Layout) -> bool:
        """Whether parts joined for good become one body. Raises InputError (Usage) where they have
        to, and shall not."""
        if self.fuse is None:
            return fusing_pays(layout.factory, layout.product)
        if not self.fuse and layout.factory.takes_wholes:
            why = "an arm takes sub-assemblies, and each of these is one body"
            raise usage_error(why, "leave out --no-fuse")
        return self.fuse


def check_ideal(fuse: bool | None, monitor: bool = False) -> None:
    """Raises InputError (Usage) for options that need bodies, which the ideal world lacks."""
    for wanted, purpose in ((monitor, "for a monitor to observe"), (fuse, "that could become one")):
        if wanted:
            raise usage_error(f"the ideal world has no bodies {purpose}", "leave out --world ideal")


FUSE_FROM = 12
"""From so many robots on, runs are fused unless told otherwise."""

GEOMS = 100
"""But not where sub-assemblies would have more convex bodies than this for each part: each has
those of all that it is made of, so that a chain of n parts has n / 2 for each."""


def fusing_pays(factory: Factory, product: Product) -> bool:
    """Whether one body for each sub-assembly makes a run faster, as measured."""
    pieces = {o.label: len(product.solids[o.label].pieces) for o in factory.leaves}
    wholes = [factory.contents[o.label] for o in factory.making if len(o.inputs) > 1]
    geoms = sum(pieces[part] for parts in wholes for part in parts)
    return len(factory.robots) >= FUSE_FROM and geoms <= GEOMS * len(factory.leaves)
