"""Counts of consecutive failures, and the template's response to them."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from factory.plant.factory import Operation
from factory.problem.template import Kind, Response


@dataclass(slots=True)
class OnEnd:
    """Consecutive repetitions of each operation (`tried`, by index) and consecutive scrappings of
    each label (`scrapped`)."""

    tried: Counter[int] = field(default_factory=Counter)
    scrapped: Counter[str] = field(default_factory=Counter)

    def response(self, operation: Operation, test: str) -> Kind:
        """The response of the template to a failure of an operation repeated so many times."""
        tried, none = self.tried[operation.index], tuple[Response, ...]()
        failures = operation.template.failures
        responses = next((f.responses for f in failures if f.test == test), none)
        left = (r for r in responses if r.kind != "again" or tried < r.times)
        return next((response.kind for response in left), "scrap")
