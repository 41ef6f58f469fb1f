"""What has gone wrong how often on end, and what its template says is done about it then."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from factory.plant.factory import Operation
from factory.problem.template import Kind, Response


@dataclass(slots=True)
class OnEnd:
    """How often on end an operation (index) was `tried` again, and a label `scrapped`."""

    tried: Counter[int] = field(default_factory=Counter)
    scrapped: Counter[str] = field(default_factory=Counter)

    def response(self, operation: Operation, test: str) -> Kind:
        """What is done about a failure of an operation that has been tried so often."""
        tried, none = self.tried[operation.index], tuple[Response, ...]()
        failures = operation.template.failures
        responses = next((f.responses for f in failures if f.test == test), none)
        left = (r for r in responses if r.kind != "again" or tried < r.times)
        return next((response.kind for response in left), "scrap")
