"""Choose the relays: few, for the wanted cycle time.

The layout is made with room for two lanes on every guidepath that could be cut. Then ways get one
relay more each where a robot whose gear takes too long waits for them, until none does or none can
be cut. What cannot be certified is not cut.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace

from factory.api import (
    NOPART,
    Ground,
    Hands,
    Layout,
    LayoutMachines,
    LayoutSearch,
    Pace,
    Robot,
    Settings,
    all_templates,
    load_catalogue,
    pace,
)
from factory.apps.relay.splitting import origin_of, split
from factory.apps.relay.ways import Way, ways
from factory.support.boxes import Point2
from factory.support.collector import collector_paused

WITHIN = 1.05
"""Where no cycle time is asked for: that of the most relays there can be, times this."""

GUESS = 0.6
"""At first no piece of a way takes longer than this share of the wanted cycle time."""

MET = 5e-3
"""A predicted cycle time is no longer than wanted within this [s]."""

WIDENED = 3
"""So often the layout is made anew to have room for relays on guidepaths that got longer."""


def relay(layout: Layout, ground: Ground, settings: Settings, hands: Hands) -> Layout:
    """The variant of a layout with relays that a ground asks for. Raises RunError (Layout)."""
    return relayed(layout, settings, ground.cycle, ground.floor, hands)


@collector_paused()
def relayed(
    plain: Layout,
    settings: Settings,
    cycle: float | None = None,
    floor: Point2 | None = None,
    hands: Hands | None = None,
) -> Layout:
    """A layout with relays, its own net and certificate, for a `cycle` time [s] if one is given, or
    near the least there can be; `plain` itself where no relay makes it faster, or some robot holds
    its labels in several places. `hands`: those to choose from, where they are known. Raises
    RunError (Layout) where it does not fit the floor.

    A search goes by lengths alone; where the cycle time that is predicted of what it finds is
    longer than wanted, it is searched again for one that is as much shorter, then for the least."""
    if plain.factory.folded:
        return plain
    if hands is None and plain.hands:
        hands = Hands(plain.factory, plain.product, settings.acceleration)
    room = Room(plain, Pace.of(settings), floor, hands)
    layout = _relayed(room, settings, cycle)
    if cycle is None:
        return layout

    def seconds(one: Layout) -> float:
        return pace(one, settings)[0].seconds

    late = seconds(layout) - cycle
    for aim in (cycle - late, None) if late > MET else ():
        layout = min(layout, _relayed(room, settings, aim), key=seconds)
        if seconds(layout) <= cycle + MET:
            break
    return layout


def _relayed(room: Room, settings: Settings, cycle: float | None) -> Layout:
    """The layout with few relays for a cycle time [s] by lengths alone, certified."""
    plain = room.plain
    search = _searched(room, room.cuttable(), settings, cycle)
    used = {way.robot for label, way in search.ways.items() if search.numbers[label]}
    again = _searched(room, used, settings, search.cycle)
    if again.seconds(again.found) <= max(search.cycle, search.seconds(search.found)) + 1e-9:
        search = again
    if not search.seconds(search.found) < search.seconds(plain):
        return plain
    return replace(LayoutMachines(search.found).certified(room.floor), plain=plain)


@dataclass(frozen=True, slots=True)
class Room:
    """Makes room for lanes in a `plain` layout."""

    plain: Layout
    pace: Pace
    floor: Point2 | None
    hands: Hands | None

    def layout(self, wide: Collection[int]) -> Layout:
        """The layout with room for two lanes on the guidepaths of these robots."""
        plain = self.plain
        where = plain.factory, plain.product, plain.clearance
        return LayoutSearch(*where, self.pace, self.hands).best(self.floor, wide)

    def cuttable(self) -> set[int]:
        """The robots with a way that can be cut if all of these have room for it."""
        layout, wide = self.plain, set[int]()
        for _ in range(WIDENED):
            more = wide | {way.robot for way in ways(layout).values()}
            if more == wide:
                break
            wide, layout = more, self.layout(more)
        return wide


def _searched(
    room: Room, wide: Collection[int], settings: Settings, cycle: float | None
) -> _Search:
    """What was found with relays for these robots alone, such that it can be certified, and all
    that robots in line hold can be held."""
    layout = room.layout(wide)
    chosen = {label: way for label, way in ways(layout).items() if way.robot in wide}
    search = _Search(layout, chosen, settings)
    search.look(cycle)
    while search.ways and (faulty := search.faulty()):
        search.forbid(faulty)
        search.look(cycle)
    return search


class _Search:
    """Looks for `numbers` of relays on the `ways` of a layout; `found`: the layout with them,
    `cycle`: what it was to reach [s]."""

    def __init__(self, layout: Layout, ways: Mapping[str, Way], settings: Settings) -> None:
        self.layout, self.ways, self.settings = layout, ways, settings
        self.pace = Pace.of(settings)
        used = {o.template.name: o.template for o in layout.factory.operations}
        self.templates = {**all_templates(), **used}
        self.numbers: dict[str, int] = {}
        self.found = layout
        self.cycle = 0.0

    def seconds(self, layout: Layout) -> float:
        """The cycle time [s]."""
        return max(self.pace.cycle_of(layout), *self._times(layout))

    def _times(self, layout: Layout) -> list[float]:
        """Time of each robot's gear [s]; for the output robot at least that of the outfeed."""
        seconds = self.pace.gear_times(layout)
        dropoff = layout.factory.dropoff.index
        way = layout.home(0, dropoff) - layout.visits[dropoff, 0].at
        outfeed = (
            self.pace.rest(way)
            + self.pace.lost
            + LayoutMachines(layout).outfeed_time(self.settings)
        )
        seconds[0] = max(seconds[0], outfeed)
        return seconds

    def look(self, cycle: float | None) -> None:
        """Find few relays with which the factory is as fast as wanted, or as possible."""
        if cycle is None:
            most = self._split({label: way.most for label, way in self.ways.items()})
            cycle = WITHIN * self.seconds(most)
        times = self._times(self.layout)
        late = {label: way for label, way in self.ways.items() if times[way.robot] > cycle}
        self.cycle, self.numbers = cycle, dict.fromkeys(self.ways, 0)
        self.numbers |= {label: self._guess(way, GUESS * cycle) for label, way in late.items()}
        self.found = self._split(self.numbers)
        while more := self._more():
            self.numbers = {label: n + (label in more) for label, n in self.numbers.items()}
            self.found = self._split(self.numbers)

    def faulty(self) -> set[str]:
        """The robots (by name) that no hand serves although one does without relays; if there are
        none, those with a fault of the certificate."""
        robots, hands = self.found.factory.robots, self.found.hands
        none = {h for h in self.layout.hands if h is not None and not h.kind.holds}
        held = {
            robots[number].name
            for number, hand in enumerate(hands)
            if hand is not None and not hand.kind.holds and hand not in none
        }
        return held or {
            name for fault in LayoutMachines(self.found).certify().faults for name in fault.robots
        }

    def forbid(self, robots: Collection[str]) -> None:
        """Exclude the ways of which one of these robots (by name) has a piece; if there are none,
        all ways."""
        chosen = (r for r in self.found.factory.robots if r.name in robots)
        labels = {origin_of(x) for robot in chosen for x in _carried(self.found, robot)}
        shared = labels & set(self.ways)
        self.ways = {k: way for k, way in self.ways.items() if shared and k not in shared}

    def _split(self, numbers: Mapping[str, int]) -> Layout:
        return split(self.layout, self.ways, numbers, self.templates, load_catalogue())

    def _guess(self, way: Way, seconds: float) -> int:
        """The least number of cuts that leaves no piece too long."""
        fast = (n for n in range(way.most) if self.pace.rest(way.longest(n)) <= seconds)
        return next(fast, way.most)

    def _more(self) -> set[str]:
        """The ways to cut once more: for each robot that takes too long the longest way that it
        waits for, or goes itself."""
        to_cut = set[str]()
        times, numbers = self._times(self.found), self.numbers
        for robot in self.found.factory.robots:
            if times[robot.index] > self.cycle + 1e-9:
                labels = map(origin_of, _carried(self.found, robot))
                left = [x for x in labels if x in self.ways and numbers[x] < self.ways[x].most]
                if left:
                    to_cut.add(max(left, key=lambda x: (self.ways[x].longest(numbers[x]), x)))
        return to_cut


def _carried(layout: Layout, robot: Robot) -> Iterator[str]:
    """All labels carried in the operations of a robot, to them and from them."""
    for number in robot.operations:
        operation = layout.factory.operations[number]
        yield from (x for x in (*operation.before, *operation.after) if x != NOPART)
