"""The request for a run."""

from __future__ import annotations

from dataclasses import dataclass, field

from factory.engine.timing.demand import Demand
from factory.support.bounds import WorldName, check_values
from factory.support.settings import Settings
from factory.theory.nets.petri import Marking
from factory.theory.problem.robot_types import Catalogue


@dataclass(frozen=True, slots=True)
class RunRequest:
    """A run of a laid-out factory, as it is asked for.

    Attributes:
        world: ideal or mujoco.
        units: number of units to drop off.
        seed: with `jitter` it gives the speed and gain of each robot.
        jitter: the most by which these differ from the settings, as a share.
        settings: the settings.
        start: the marking it begins from; None for m_0.
        wip: most units inside at once; None for the default.
        distributed: whether robots run their own programs (section 6).
        fuse: whether parts joined for good become one rigid body.
        shown: whether it is filmed, logged or watched. If not, the model has nothing that is only
            shown; the run is the same and faster.
        recovers: whether there are some bodies more, for parts that are scrapped.
        fast: whether it uses what only makes it faster.
        catalogue: the robot types; None for those that are shipped.
        demand: the order in which the products of a mix are made; None for its sequence.

    Raises InputError (Usage) with every value out of its bounds.
    """

    world: WorldName = "mujoco"
    units: int = 1
    seed: int = 0
    jitter: float = 0.0
    settings: Settings = field(default_factory=Settings)
    start: Marking | None = None
    wip: int | None = None
    distributed: bool = False
    fuse: bool = False
    shown: bool = True
    recovers: bool = False
    fast: bool = True
    catalogue: Catalogue | None = field(default=None, hash=False)
    demand: Demand | None = None

    def __post_init__(self) -> None:
        names = ("world", "units", "seed", "jitter", "wip")
        check_values({name: getattr(self, name) for name in names})
