"""Order places in a run: an operation starts when the machines that it waits for are past.

Nothing is kept of them. Which of the two places before and after a pass is marked follows from how
often the transitions of the compiled net have fired, and where its robot is on its way, from where
the axis is: so it is after an undo too, and where a run begins in any marking.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from factory.control.mode import Array
from factory.nets.coordinated import Order, Past


class Ordering:
    """The order places of a coordinated net, by the transition that waits. `held`: the passes that
    transitions have been found to wait for."""

    def __init__(self, orders: Iterable[Order] = ()) -> None:
        self.held = set[Past]()
        self._by_start: dict[int, list[Order]] = {}
        for order in orders:
            self._by_start.setdefault(order.start, []).append(order)

    def hold_up(self, start: int, fired: Callable[[int], int], sense: Callable[[], Array]) -> bool:
        """Whether a transition still waits for a pass, where `fired` says how often others have and
        axes are where `sense` says [m]; which is held then."""
        if start not in self._by_start:
            return False
        x = sense()
        awaited = [
            order.past
            for order in self._by_start[start]
            if fired(order.past.after) + order.tokens == fired(start) + 1
            and fired(order.end) < fired(order.past.after) + order.held
            and not order.past.holds(float(x[order.past.axis]))
        ]
        self.held.update(awaited)
        return bool(awaited)

    def goes_on(self, x: Array) -> bool:
        """Whether a pass that is held has come, with axes at `x` [m]."""
        return any(past.holds(float(x[past.axis])) for past in self.held)

    def axes(self, starts: Iterable[int]) -> set[int]:
        """The axes that transitions wait for."""
        return {order.past.axis for start in starts for order in self._by_start.get(start, ())}
