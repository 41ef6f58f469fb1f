"""Order places in a run: an operation starts when the machines that it waits for have passed.

No state is kept. Which of the two places before and after a pass is marked follows from the firing
counts of the compiled net, and for a robot on its way from the position of its axis. So it holds
after an undo too, and in any initial marking.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

from factory.support.arrays import Array
from factory.theory.nets.coordinated import Order, Past


class Ordering:
    """The order places of a coordinated net, by the waiting transition. For a place that begins
    with a pass, the transition before the pass is waited for too.

    Attributes:
        held: the passes that transitions were found to wait for.
        lacking: the transitions that transitions were found to wait for.
    """

    def __init__(self, orders: Iterable[Order] = ()) -> None:
        self.held, self.lacking = set[Past](), set[int]()
        self._by_start: dict[int, list[Order]] = {}
        for order in orders:
            before = [replace(order, past=None)] if order.past else []
            self._by_start.setdefault(order.start, []).extend([*before, order])

    def ask_anew(self) -> None:
        """Forget what transitions were found to wait for."""
        self.held.clear()
        self.lacking.clear()

    def hold_up(self, start: int, fired: Callable[[int], int], sense: Callable[[], Array]) -> bool:
        """Whether a transition still waits for another or for a pass, with firing counts `fired`
        and axes where `sense` says [m]. Notes which."""
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
        """Whether an awaited pass has come, with axes at `x` [m]."""
        return any(past.holds(float(x[past.axis])) for past in self.held)

    def keep_passes(self) -> None:
        """Let transitions wait for passes only: those come by themselves, also in a marking that is
        not reachable from the initial one."""
        for orders in self._by_start.values():
            orders[:] = [order for order in orders if order.past is not None]

    def axes(self, starts: Iterable[int]) -> set[int]:
        """The axes of awaited passes."""
        asked = (order.past for start in starts for order in self._by_start.get(start, ()))
        return {past.axis for past in asked if past is not None}
