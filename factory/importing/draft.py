"""A product as its file describes it, before it is a PAG: nodes with the indices of their
inputs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from factory.problem.pag import Parameter
from factory.support.errors import Diagnostic, InputError, Position

PART, MATE = "atomic", "mate"

MOST_NODES = 100_000
"""The most parts and sub-assemblies of a product; a larger file is a mistake, or an attack."""

SHOWN = 20
"""The most errors of one product that are reported."""


@dataclass(slots=True)
class DraftNode:
    """A part or sub-assembly. `inputs`: indices in the list of drafts, of which the first is the
    product; empty for a part. `name`: that in the file, "" for none; a `kept` name is a label
    chosen by the user, which no other node may have."""

    name: str
    position: Position
    operation: str = MATE
    inputs: list[int] = field(default_factory=list)
    parameters: tuple[Parameter, ...] = ()
    kept: bool = False

    @property
    def is_part(self) -> bool:
        return self.operation == PART


@dataclass(slots=True)
class ImportFaults:
    """The errors and warnings of one product's files."""

    diagnostics: list[Diagnostic] = field(default_factory=list)
    warnings: list[Diagnostic] = field(default_factory=list)

    def add(self, code: str, message: str, position: Position, hint: str) -> None:
        """Note an error: what was found, where, and what would have been valid."""
        self.diagnostics.append(Diagnostic(code, message, position, hint))

    def warn(self, code: str, message: str, position: Position, hint: str, many: str) -> None:
        """Note a warning; `many`: the text for several of its kind."""
        self.warnings.append(Diagnostic(code, message, position, hint, many))

    def check_used_once(self, what: str, places: Iterable[Position]) -> None:
        """Note every place but the first that puts the same part in the same place (UsedTwice)."""
        first, *others = sorted(places, key=_key)
        for position in others:
            where = f"line {first.line}" if first.line != position.line else "this line"
            message = f"{what} is where {where} already places it"
            hint = "give each copy its own place, or remove one"
            self.add("UsedTwice", message, position, hint)

    def raise_if_any(self) -> None:
        """Raise one InputError with the first errors, if there are any. Errors that differ only in
        their positions are merged."""
        groups: dict[tuple[str, str], list[Diagnostic]] = {}
        for diagnostic in sorted(self.diagnostics, key=lambda d: _key(d.position)):
            groups.setdefault((diagnostic.code, diagnostic.message), []).append(diagnostic)
        errors = [_once(alike) for alike in groups.values()]
        if len(errors) > SHOWN:
            message = f"and {len(errors) - SHOWN} more errors"
            errors = [*errors[:SHOWN], Diagnostic(errors[-1].code, message)]
        if errors:
            raise InputError(errors)


def _once(alike: list[Diagnostic]) -> Diagnostic:
    """The first of several equal diagnostics, with the number of others."""
    places = len({d.position for d in alike}) - 1
    more = f" (and in {places} more place{'s' * (places > 1)})" if places else ""
    return replace(alike[0], message=alike[0].message + more)


def _key(at: Position | None) -> tuple[str, int, int]:
    """The sort key of a position: file, line and column."""
    return (at.file, at.line, at.column) if at else ("", 0, 0)


def postorder(drafts: Sequence[DraftNode]) -> list[int]:
    """The indices of all nodes below the first, each after its inputs."""
    order, stack = [], [(0, False)]
    while stack:
        index, expanded = stack.pop()
        if expanded or not drafts[index].inputs:
            order.append(index)
        else:
            stack.append((index, True))
            stack.extend((child, False) for child in reversed(drafts[index].inputs))
    return order


def too_many(position: Position) -> InputError:
    """The error of a product that is too large."""
    message = f"the product has more than {MOST_NODES} parts and sub-assemblies"
    hint = "import its sub-assemblies one by one"
    return InputError(Diagnostic("TooLarge", message, position, hint))
