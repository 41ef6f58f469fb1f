"""The warnings that a command prints."""

from __future__ import annotations

from collections.abc import Sequence

from factory.support.errors import Diagnostic

SHOWN = 24
"""The most blocked operations that are listed, unless `-v` asks for all."""


def told(warnings: Sequence[Diagnostic], verbose: bool) -> list[Diagnostic]:
    """All warnings; of those of blocked operations, unless `verbose`, the first and how many more
    there are."""
    blocked = [warning for warning in warnings if warning.code == "Blocked"]
    more = len(blocked) - SHOWN
    if verbose or more <= 0:
        return list(warnings)
    count = Diagnostic("Blocked", f"and {more} more operations are blocked", None, "list: -v")
    others = [warning for warning in warnings if warning.code != "Blocked"]
    return [*others, *blocked[:SHOWN], count]
