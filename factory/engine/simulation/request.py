"""The request for a run."""

from __future__ import annotations

from dataclasses import dataclass, field

from factory.support.bounds import WORLDS, WorldName, check_choice, check_values
from factory.support.settings import Settings
from factory.theory.nets.petri import Marking
from factory.theory.plant.demand import Demand
from factory.theory.problem.robot_types import Catalogue


@dataclass(frozen=True, slots=True)
class RunRequest:
    """A run of a laid-out factory in a `world`, until `units` products are dropped off.

    `seed` and `jitter` draw each robot's speed and gain within ± jitter. `start`: the marking it
    begins from, m_0 where None. `wip`: most units inside at once. `distributed`: robots run their
    own programs. `fuse`: parts joined for good become one rigid body. `shown`: it is filmed, logged
    or watched; if not, the model has nothing that is only shown, and the run is the same and
    faster. `recovers`: with some bodies more, for parts that are scrapped. `fast`: with what only
    makes it faster. `catalogue`: robot types, the shipped ones where None. `demand`: the
    order in which the products of a mix are made, as its sequence says where None. Raises
    InputError (Usage) with every value out of its bounds.
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
        check_choice("world", self.world, WORLDS)
        check_values({n: getattr(self, n) for n in ("units", "seed", "jitter", "wip")})
