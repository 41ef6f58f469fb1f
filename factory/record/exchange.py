"""Robots that were exchanged in a run: a deputy took over for one that died."""

from __future__ import annotations

from dataclasses import dataclass, field

from factory.nets.gears import GearNet
from factory.plant.factory import Factory


@dataclass(frozen=True, slots=True)
class Exchange:
    """A `deputy` that took over the tours of a robot that is `dead`, by their names, at time t [s].

    `fired`: n', the counts from which the run went on in another `net`, which was proved before;
    `crew`: its factory, in which all robots keep their numbers; `cycle_time`: what is predicted for
    it [s].
    """

    t: float
    dead: str
    deputy: str
    fired: tuple[int, ...] = field(repr=False)
    net: GearNet = field(repr=False)
    crew: Factory = field(repr=False)
    cycle_time: float

    def __str__(self) -> str:
        return (
            f"{self.deputy} takes over the tours of {self.dead} (deputy);"
            f" predicted from then on: {self.cycle_time:.3f} s"
        )

    def as_json(self) -> dict[str, object]:
        """As `run --json` prints it, the counts by the names of transitions."""
        names = (transition.name for transition in self.net.threaded.transitions)
        return {
            "t": round(self.t, 6),
            "dead": self.dead,
            "deputy": self.deputy,
            "predicted_cycle_time_s": self.cycle_time,
            "fired": dict(zip(names, self.fired, strict=True)),
        }
