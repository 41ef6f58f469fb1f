"""Order places in a run: an operation starts when the machines that it waits for are past.

Nothing is kept of them. Which of the two places before and after a pass is marked follows from how
often the transitions of the compiled net have fired, and where its robot is on its way, from where
the axis is: so it is after an undo too, and where a run begins in any marking.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from factory.control.mode import Array
from factory.nets.coordinated import Order, Past


class Orders:
    """The order places of a coordinated net, by the transition that waits."""

    def __init__(self, orders: Iterable[Order] = ()) -> None:
        self._by_start: dict[int, list[Order]] = {}
        for order in orders:
            self._by_start.setdefault(order.start, []).append(order)

    def awaited(self, start: int, fired: Sequence[int], x: Array) -> list[Past]:
        """The passes that a transition still waits for, where transitions have `fired` so often and
        axes are at `x` [m]."""
        return [
            order.past
            for order in self._by_start.get(start, ())
            if fired[order.past.after] + order.tokens == fired[start] + 1
            and fired[order.end] < fired[order.past.after] + order.held
            and not order.past.holds(float(x[order.past.axis]))
        ]

    def axes(self, starts: Iterable[int]) -> set[int]:
        """The axes that transitions wait for."""
        return {order.past.axis for start in starts for order in self._by_start.get(start, ())}

    def __contains__(self, start: int) -> bool:
        return start in self._by_start
