"""The figures of the bodies of a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from factory.support.errors import Diagnostic
from factory.theory.plant.approaches import Pair


@dataclass(frozen=True, slots=True)
class PhysicsFigures:
    """What only the engine can tell; see the specification of `run` for each.

    `product_angle_max_deg`: how far any part of a product was turned against its first one,
    `misplaced`: the label of the one that was out of place most;
    `handoff_angle_max_deg`: the same of the frames that a grip joined as it closed;
    `joining_error_max_mm`: how far any vertex of a part was from its place as a grip closed on it,
    before welds pulled: `product_error_max_mm` is what is left of that. `mating_forces`: by
    operation, the largest force of a contact between inputs that it was joining [N]; `pairs`: how
    many pairs of parts there are; `excluded`: those whose contact was off; `timestep_chosen`: by
    the factory, not by the user; `wip_chosen`: the bound on units inside at once where the factory
    chose one; `contact_first_s`: when the first unintended contact began, `dropped_s`: when a load
    was dropped [s]; `faults`: what was not as it should be of the engine's model; `reservations`:
    what a run of this model does not show, in words.
    """

    handoffs: int = 0
    handoff_gap_max_mm: float = 0.0
    weld_residual_max_mm: float = 0.0
    product_error_max_mm: float | None = None
    unintended_contacts: int = 0
    engine_warnings: int = 0
    contacts: tuple[str, ...] = ()
    mating_forces: Mapping[str, float] = field(default_factory=dict)
    pairs: int = 0
    excluded: tuple[Pair, ...] = ()
    fused: bool = False
    timestep_s: float = 0.0
    timestep_chosen: bool = False
    wip_chosen: int | None = None
    grip_gap_max_mm: float | None = None
    product_angle_max_deg: float | None = None
    handoff_angle_max_deg: float = 0.0
    misplaced: tuple[str, ...] = ()
    contact_first_s: float | None = None
    dropped_s: float | None = None
    faults: tuple[Diagnostic, ...] = ()
    reservations: tuple[str, ...] = ()
    joining_error_max_mm: float = 0.0
    grip_strength_share_max: float | None = None
    grip_strength_robot: str | None = None
    grip_strength_label: str | None = None

    @property
    def pairs_excluded(self) -> int:
        """How many pairs of parts were not tested against each other."""
        return len(self.excluded)

    @property
    def pairs_tested(self) -> int:
        """How many pairs of parts were tested against each other."""
        return self.pairs - len(self.excluded)

    @property
    def mating_force_max_n(self) -> float:
        """The largest force with which inputs touched while they were being joined [N]."""
        return max(self.mating_forces.values(), default=0.0)
