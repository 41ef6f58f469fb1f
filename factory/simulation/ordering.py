"""Order places in a run: an operation starts when the machines that it waits for are past.

Nothing is kept of them. Which of the two places before and after a pass is marked follows from how
often the transitions of the compiled net have fired, and where its robot is on its way, from where
the axis is: so it is after an undo too, and where a run begins in any marking.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

from factory.control.mode import Array
from factory.nets.coordinated import Order, Past


class Ordering:
    """The order places of a coordinated net, by the transition that waits; of one that begins with
    a pass also the transition that the pass follows is waited for. `held`: the passes that
    transitions have been found to wait for; `lacking`: the transitions that they have."""

    def __init__(self, orders: Iterable[Order] = ()) -> None:
        self.held, self.lacking = set[Past](), set[int]()
        self._by_start: dict[int, list[Order]] = {}
        for order in orders:
            before = [replace(order, past=None)] if order.past else []
            self._by_start.setdefault(order.start, []).extend([*before, order])

    def ask_anew(self) -> None:
        """Nothing has been found yet."""
        self.held.clear()
        self.lacking.clear()

    def hold_up(self, start: int, fired: Callable[[int], int], sense: Callable[[], Array]) -> bool:
        """Whether a transition still waits for another, or for a pass, where `fired` says how often
        others have and axes are where `sense` says [m]; which is noted then."""
        if start not in self._by_start:
            return False
        x, waits = sense(), False
        for order in self._by_start[start]:
            past, more = order.past, fired(order.before) + order.tokens - fired(start) - 1
            if past is None:
                lacks = more == -1
                self.lacking.update([order.before] * lacks)
            else:
                under_way = more == 0 and fired(order.end) < fired(order.before) + order.held
                lacks = under_way and not past.holds(float(x[past.axis]))
                self.held.update([past] * lacks)
            waits = waits or lacks
        return waits

    def goes_on(self, x: Array) -> bool:
        """Whether a pass that is held has come, with axes at `x` [m]."""
        return any(past.holds(float(x[past.axis])) for past in self.held)

    def keep_passes(self) -> None:
        """From now on transitions wait for passes alone: those come by themselves, in a marking
        too which the net does not come to from where it begins."""
        for orders in self._by_start.values():
            orders[:] = [order for order in orders if order.past is not None]

    def axes(self, starts: Iterable[int]) -> set[int]:
        """The axes that transitions wait for."""
        asked = (order.past for start in starts for order in self._by_start.get(start, ()))
        return {past.axis for past in asked if past is not None}
