"""The figures of the bodies of a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from factory.support.errors import Diagnostic
from factory.theory.plant.approaches import Pair


@dataclass(frozen=True, slots=True)
class PhysicsFigures:
    """Figures of a run that only the engine can tell.

    Attributes:
        handoffs: number of parts that changed hands.
        handoff_gap_max_mm: largest distance of the frames that a weld joined as it closed [mm].
        handoff_angle_max_deg: largest angle between them [°].
        joining_error_max_mm: largest displacement of a vertex of a part from its place as a
            weld closed on it, before that pulled [mm]; `product_error_max_mm` is what is left
            of it.
        weld_residual_max_mm: largest position error of a closed weld [mm].
        product_error_max_mm: largest displacement of a part in a finished product [mm]; None
            before the first.
        product_angle_max_deg: largest angle of a part against the first of its product [°].
        misplaced: the label of the part that was out of place most.
        unintended_contacts: number of contacts that were not meant.
        contacts: the pairs that touched so, by name.
        contact_first_s: time of the first [s].
        engine_warnings: number of the engine's warnings.
        mating_forces: by operation, the largest force of a contact between inputs that it
            joined [N].
        pairs: number of pairs of parts.
        excluded: the pairs whose contact was off.
        fused: whether joined parts became one body.
        timestep_s: the timestep [s].
        timestep_chosen: whether it was chosen by the factory.
        wip_chosen: the bound on units inside at once where the factory chose one.
        grip_gap_max_mm: largest distance between the pads of a holder and its payload [mm].
        grip_strength_share_max: largest share of a hand's strength that its load used.
        grip_strength_robot: the robot of that hand.
        grip_strength_label: what it held.
        dropped_s: time when a load was dropped [s].
        faults: what of the engine's model was not as it should be.
        reservations: what a run of this model does not show, in words.
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
