"""The quantities of a comparison, each with its unit and definition."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True, slots=True)
class Quantity:
    """A figure of one run (or of the two runs of a seed): its key, unit and definition.

    `least`: the worst value is the smallest, not the largest. `limit`: bound for a good factory,
    None for none.
    """

    key: str
    unit: str
    definition: str
    limit: float | None = None
    least: bool = False

    def worst(self, values: Iterable[float | None]) -> float | None:
        """The worst of some values; None without values."""
        numbers = [value for value in values if value is not None]
        if not numbers:
            return None
        return min(numbers) if self.least else max(numbers, key=abs)

    def exceeded(self, value: float | None) -> bool:
        """Whether a value is beyond the limit."""
        if value is None or self.limit is None:
            return False
        return value < self.limit if self.least else abs(value) > self.limit

    def as_json(self) -> dict[str, object]:
        """The definition as the report lists it."""
        return {"unit": self.unit, "definition": self.definition, "limit": self.limit}


_ALL = (
    Quantity(
        "orders_swapped_percent",
        "%",
        "Pairs of causally unrelated firings that come in opposite order in the two worlds, of all "
        "such pairs that are apart in time in both. Concurrent firings may swap: no limit.",
    ),
    Quantity(
        "causes_differing",
        "firings",
        "Firings whose immediate causes (the firings that made the tokens they take) differ "
        "between the two records. 0: both records are the same partial order.",
        0,
    ),
    Quantity(
        "illegal_records",
        "records",
        "How many of the two records an independent replay refuses as runs of the net.",
        0,
    ),
    Quantity(
        "monitor_violations",
        "violations",
        "Observations of the independent monitor, which sees only the engine, that contradict the "
        "net.",
        0,
    ),
    Quantity(
        "firing_difference_mean_s",
        "s",
        "Mean over all firings of |t in MuJoCo - t in the ideal world|, the n-th firing of a "
        "transition against the n-th. Includes differences accumulated since the beginning.",
    ),
    Quantity("firing_difference_max_s", "s", "The largest of those differences."),
    Quantity(
        "firing_difference_mean_percent", "%", "The mean difference over the ideal cycle time."
    ),
    Quantity(
        "firing_difference_max_percent", "%", "The largest difference over the ideal cycle time."
    ),
    Quantity(
        "duration_difference_mean_s",
        "s",
        "Mean over all operations of (X_e - X_s in MuJoCo) - (X_e - X_s in the ideal world): what "
        "acceleration and settling add to one operation.",
    ),
    Quantity("duration_difference_max_s", "s", "The largest of those, by size."),
    Quantity(
        "cycle_time_s",
        "s",
        "Mean interval between dropoffs in MuJoCo over the last half of the units; none below 4.",
    ),
    Quantity("ideal_cycle_time_s", "s", "The same in the ideal world."),
    Quantity(
        "cycle_from_ideal_percent",
        "%",
        "Cycle time in MuJoCo over that in the ideal world, less 1.",
    ),
    Quantity(
        "cycle_from_predicted_percent",
        "%",
        "Cycle time in MuJoCo over the one predicted for it before the run, less 1.",
        2,
    ),
    Quantity(
        "tracking_error_max_mm",
        "mm",
        "Largest |measured - reference position| of any axis (robots, lifts, the tray) at the end "
        "of any tick.",
        1,
    ),
    Quantity(
        "tracking_error_p99_mm", "mm", "99th percentile of it over axes whose reference moves."
    ),
    Quantity("tracking_error_rms_mm", "mm", "Root mean square over the same."),
    Quantity(
        "handoffs",
        "switches",
        "Grips and holds of a part switched on as another carrier releases it.",
    ),
    Quantity(
        "handoff_gap_max_mm",
        "mm",
        "Largest distance between the two frames a weld joins, just before it is switched on.",
        1,
    ),
    Quantity(
        "speed_step_max_mm_s",
        "mm/s",
        "Largest |velocity of a part - velocity of its new carrier| at the switch.",
        10,
    ),
    Quantity(
        "impulse_max_mNs",
        "mN s",
        "Momentum that the new welds give the parts of one hand-off, relative to their carrier: "
        "the largest sum over the parts of mass x |change of relative velocity| within 50 ms.",
    ),
    Quantity(
        "handoff_energy_max_mJ_per_kg",
        "mJ/kg",
        "Energy that a hand-off injects: kinetic energy of the parts in the frame of their new "
        "carrier (translation and rotation), its peak within 50 ms less its value at the switch, "
        "over their mass. A weld that finds its part x away gives it (x w^2 h)^2 / 2, with w one "
        "over its time constant and h the timestep: 7.8 at 1 mm.",
        0.5,
    ),
    Quantity(
        "weld_residual_max_mm",
        "mm",
        "Largest distance between the frames joined by an active, awake weld, at the end of ticks.",
        1,
    ),
    Quantity(
        "weld_residual_p99_mm",
        "mm",
        "99th percentile of it over ticks and welds to what goes faster than 10 mm/s.",
        0.1,
    ),
    Quantity(
        "product_position_max_mm",
        "mm",
        "Largest displacement of a part's centre of mass from its place in the product, after a "
        "rigid fit on the first part: at the dropoff, and when the tray has taken it away.",
        0.1,
    ),
    Quantity(
        "product_angle_max_deg", "deg", "Largest angle of a part from its place, likewise.", 0.1
    ),
    Quantity("product_vertex_max_mm", "mm", "Largest displacement of any vertex of a part.", 0.1),
    Quantity(
        "closest_approach_mm",
        "mm",
        "Least distance between the surfaces of two bodies that are not meant to touch, the "
        "outfeed's table aside; as much as the detection distance where nothing came nearer.",
        least=True,
    ),
    Quantity(
        "clearance_margin_mm",
        "mm",
        "Least distance less the distance certified for that kind of pair (in plan the layout's "
        "clearance, between layers their gap). Below 0 by no more than the tracking error.",
        -1,
        least=True,
    ),
    Quantity(
        "hidden_penetration_max_mm",
        "mm",
        "Deepest penetration between any two things that are drawn, with all of them solid, every "
        "20 ms: no contact is left out except between things fixed to each other. Of parts that "
        "overlap in the finished product, only the penetration beyond that overlap.",
        0.1,
    ),
    Quantity(
        "grip_gap_max_mm",
        "mm",
        "Largest distance between the pads of a robot, a feeder or the tray and the nearest of the "
        "bodies that it takes, when it takes its first.",
        0.5,
    ),
    Quantity(
        "grip_strength_share_max",
        "",
        "Largest share of the strength of a hand's tips used by the force and moment of its load, "
        "measured several times a second; none if hands are not chosen (--no-hands). "
        "Above 1 the hand lets go (Dropped).",
        1,
    ),
    Quantity(
        "force_saturated_percent",
        "%",
        "Share of timesteps in which a drive's force is at least 99.9 % of its limit; the worst "
        "drive.",
        1,
    ),
    Quantity("force_peak_percent", "%", "Largest force of a drive over its limit.", 100),
    Quantity("drive_work_J", "J", "Work of all drives: the integral of |force x speed|."),
    Quantity(
        "payload_acceleration_max_m_s2",
        "m/s^2",
        "Largest |change of velocity / timestep| of a part held by a robot or the tray.",
    ),
    Quantity("payload_acceleration_p99_m_s2", "m/s^2", "99th percentile over parts and timesteps."),
    Quantity(
        "payload_jerk_max_m_s3",
        "m/s^3",
        "Largest |change of a tick's mean acceleration / tick| of a part held in both ticks.",
    ),
    Quantity("payload_jerk_p99_m_s3", "m/s^3", "99th percentile over parts and ticks."),
    Quantity("moved_mass_kg", "kg", "Mass of everything that can move: carriages, tray, parts."),
    Quantity("unintended_contacts", "onsets", "Onsets of unintended contact.", 0),
    Quantity("engine_warnings", "warnings", "Warnings of the engine.", 0),
)

QUANTITIES: Mapping[str, Quantity] = MappingProxyType({q.key: q for q in _ALL})
"""Every quantity by its key, in the order of the reports."""
