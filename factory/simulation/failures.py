"""What went wrong in a run, and what was done about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from factory.record.failing import Failing


@dataclass(frozen=True)
class Failures:
    """All of a run. `struck`: faults of the world, by kind; `missed`: those that no sensor told of;
    `false_alarms`: failures that nothing caused; `undone`: how many transitions were fired
    backwards; `spares`: how many were used; `contacts`: of what fell, which are no unintended
    ones."""

    found: tuple[Failing, ...] = ()
    struck: Mapping[str, int] = field(default_factory=dict)
    missed: int = 0
    false_alarms: int = 0
    undone: int = 0
    spares: int = 0
    contacts: int = 0

    @property
    def scrapped(self) -> int:
        """How many parts and sub-assemblies were scrapped."""
        return sum(len(one.scrapped) for one in self.found)

    def as_json(self) -> dict[str, object]:
        """As `run --json` prints it."""
        return {
            "struck": dict(self.struck),
            "found": len(self.found),
            "missed": self.missed,
            "false_alarms": self.false_alarms,
            "transitions_undone": self.undone,
            "scrapped": self.scrapped,
            "spares_used": self.spares,
            "fault_contacts": self.contacts,
            "failures": [one.as_json() for one in self.found],
        }
