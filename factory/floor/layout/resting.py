"""Machines of a mix at rest, while the net goes through units that nobody has ordered.

A robot that skips units stays where its last tour left it, or where the run began. So in the wait
after its tour for a unit that is not made it may be where *any* of its tours ends, and it begins
the next one from there; a magazine may show any of its parts in place of one that is not needed.
These presences are kept apart, in the waits after all other units, from what another machine does
for a unit that is made. So while that is done the robot is on its own tour for this very unit, or
where that tour has left it, as in a fixed sequence.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from factory.floor.layout.coordinating import Coordinated
from factory.floor.layout.exclusions import Further, awaited_positions, exclusions
from factory.floor.layout.hands.limbs import rises_first
from factory.floor.layout.layout import Layout
from factory.floor.layout.machines import magazines
from factory.floor.layout.nearness import Near
from factory.floor.layout.presence import Presence
from factory.floor.layout.starting import start_positions
from factory.floor.layout.staying import Staying, Sweep, comes_last
from factory.support.arrays import Array
from factory.support.errors import InputError
from factory.theory.nets.petri import Marking
from factory.theory.problem.ids import OperationId


def on_demand(layout: Layout) -> Layout:
    """A certified layout of a mix with what keeps its machines apart for every word. Raises
    InputError (Layout) where a machine at rest stands where another has to pass."""
    assert layout.certificate is not None
    apart = exclusions(layout, resting)
    if apart.faults:
        raise InputError(fault.diagnostic() for fault in apart.faults)
    return replace(layout, certificate=replace(layout.certificate, apart=apart))


def start_at_rest(layout: Layout, marking: Marking) -> Array:
    """Where the axes of a factory are where a run on demand begins: robots that take parts from
    above wait where their tours end, since it may take long until a part comes down [m]."""
    positions, awaited = start_positions(layout, marking), awaited_positions(layout)
    for robot in layout.factory.robots:
        first = robot.operations[0]
        if comes_last(layout, robot.index, first):
            at = layout.ways[first, robot.index][0].at
            positions[robot.index] = awaited.get(robot.index, at)
    return positions


def resting(layout: Layout, coordinated: Coordinated, awaited: Mapping[int, float]) -> Further:
    """The presences of machines at rest, beside those of a fixed sequence. They do not count beside
    what is done for the very unit that is not made then, nor beside the machine's own feeder or
    robot, which give way to each other."""
    robots = Staying(layout, coordinated, awaited)
    made = [*magazines(layout, coordinated, robots, every_part=True)]
    unmade = {one: _turn(layout, one) for one in made}
    for robot in range(len(layout.factory.robots)):
        unmade |= dict(_robot(layout, robots, robot))

    def counts(pair: Near) -> bool:
        at_rest = [one for one in (pair.one, pair.other) if one in unmade]
        if len(at_rest) == 1:
            other = pair.other if pair.one in unmade else pair.one
            if _turn(layout, other) == unmade[at_rest[0]]:
                return False
        return not at_rest or pair.one.robot != pair.other.robot

    return Further(tuple(unmade), counts)


def _robot(layout: Layout, robots: Staying, robot: int) -> Iterator[tuple[Presence, int]]:
    """A robot in the waits before its tours, and in their first operations, to which it comes from
    wherever it rests; and in which turn of a period a unit is not made then, -1 for any."""
    factory, tours = layout.factory, list[tuple[int, OperationId, tuple[Sweep, ...]]]()
    for step, number in enumerate(factory.robots[robot].operations):
        if factory.begins(robot, number):
            tours.append((step, number, _rests(layout, robots, robot, step)))
    rests = tuple(dict.fromkeys(sweep for *_, sweeps in tours for sweep in sweeps))
    name, home = factory.robots[robot].name, layout.guidepaths[robot].length
    for step, number, tour_rests in tours:
        before = factory.operations[factory.robots[robot].operations[step - 1]]
        wait, begun = factory.net.gears[robot].waiting(step), factory.operations[number].place
        end = layout.visits[number, robot].at
        ways = tuple(
            ((min(end, *at), max(end, home)), lift)
            for at, lift in rests
            if (at, lift) not in tour_rests
        )
        turn = before.turn if len(tours) > 1 else -1
        for place, sweeps, unmade in ((wait, rests, turn), (begun, ways, -1)):
            if sweeps:
                bodies, partners = robots.own(robot), robots.partners[robot]
                held = partners, False, "", before.end
                yield Presence(robot, name, (place,), bodies, sweeps, *held), unmade


def _rests(layout: Layout, robots: Staying, robot: int, step: int) -> tuple[Sweep, ...]:
    """Where a robot rests in the wait before a tour, and where it begins that as a run does."""
    number = layout.factory.robots[robot].operations[step]
    since, visit = layout.ways[number, robot]
    goal, home = robots.goal(robot, step), layout.guidepaths[robot].length
    low = visit.lift if rises_first(layout, robot) else since.lift
    lift = low, visit.lift
    rest = ((goal, goal), lift if robot in layout.factory.adjusted else (low, low))
    return (rest,) if comes_last(layout, robot, number) else (rest, ((home, home), lift))


def _turn(layout: Layout, presence: Presence) -> int:
    """The unit of a period that a machine serves, or has served before, where it is; -1 for what
    stands."""
    factory = layout.factory
    if not presence.places:
        return -1
    if presence.label:
        return factory.by_label[presence.label].turn
    place = presence.places[0]
    if place < len(factory.operations):
        return factory.operations[place].turn
    step = factory.net.gears[presence.robot].step_of(place)
    return factory.operations[factory.robots[presence.robot].operations[step - 1]].turn
