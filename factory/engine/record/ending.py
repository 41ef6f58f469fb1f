"""The end of a run that was cut off."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from factory.support.errors import Diagnostic


@dataclass(frozen=True, slots=True)
class CutOff:
    """The end of a run, or of its record, before all units were made.

    Attributes:
        t: time [s].
        products: number of units made.
        units: number of units asked for.
        code: of the diagnostic that ended it, such as Timeout, Stalled or Interrupted; BadLog where
            only the record ended; "" where unknown.
        message: of that diagnostic.
    """

    t: float
    products: int
    units: int
    code: str = ""
    message: str = ""

    def __str__(self) -> str:
        """For example `cut off at 31.20 s: 4 of 20 units`."""
        return f"cut off at {self.t:.2f} s: {self.products} of {self.units} units"

    @property
    def with_cause(self) -> str:
        """The same, with the cause."""
        return f"{self}; {self.message}" if self.message else str(self)

    @property
    def failure(self) -> Diagnostic:
        """The cause, as a failure of the run."""
        return Diagnostic(self.code or "CutOff", self.message or str(self))

    def as_json(self) -> dict[str, object]:
        """The key `cut_off` of a `--json` document; it is null where the units were made."""
        return {**asdict(self), "t": round(self.t, 6)}

    def diagnostic(self, file: object) -> Diagnostic:
        """The message about the log in a file."""
        hint = "all results cover the time until then"
        return Diagnostic("CutOff", f"'{file}' is {self.with_cause}", None, hint)
