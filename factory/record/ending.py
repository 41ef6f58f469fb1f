"""How far a run came that was cut off."""

from __future__ import annotations

from dataclasses import dataclass

from factory.support.errors import Diagnostic


@dataclass(frozen=True, slots=True)
class CutOff:
    """The end of a run, or of the record of one, before its units were made: at `t` [s], with
    `products` of `units`. `code` and `message` say what ended it, as far as that is known: those of
    a diagnostic, such as Timeout, Stalled or Interrupted, or BadLog where the record ends and not
    the run."""

    t: float
    products: int
    units: int
    code: str = ""
    message: str = ""

    def __str__(self) -> str:
        """For example `cut off at 31.20 s: 4 of 20 units`."""
        return f"cut off at {self.t:.2f} s: {self.products} of {self.units} units"

    @property
    def told(self) -> str:
        """The same, and what ended it."""
        return f"{self}; {self.message}" if self.message else str(self)

    @property
    def failure(self) -> Diagnostic:
        """What ended it, as a failure of the run."""
        return Diagnostic(self.code or "CutOff", self.message or str(self))

    def as_json(self) -> dict[str, object]:
        """The key `cut_off` of a `--json` document; it is null where the units were made."""
        return {
            "t": round(self.t, 6),
            "products": self.products,
            "units": self.units,
            "code": self.code,
            "message": self.message,
        }

    def diagnostic(self, file: object) -> Diagnostic:
        """The message about the log in a file."""
        hint = "what is said of it holds until then"
        return Diagnostic("CutOff", f"'{file}' is {self.told}", None, hint)
