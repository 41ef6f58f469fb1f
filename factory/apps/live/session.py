"""A factory that runs in step with real time, and executes commands between ticks."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from threading import Condition
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from factory.api import Failing, Observer, Simulation, Undone
from factory.apps.deviations import Campaign
from factory.apps.live.commands import LASTS, PUSH, Command
from factory.apps.live.interventions import Interventions
from factory.apps.live.outages import Outages, Watch

RATE = 30.0
"""Frames a second."""

BEHIND = 0.25
"""Largest lag behind the clock that a run catches up with [s]."""

QUIET = 3.0
"""A note lists the waiting robots after this many times the longest delay without a firing."""

LOOK = 0.05
"""Interval at which a paused session looks for commands [s]."""

SHOWN = 6.0
"""How long a failure, and the effect of a push, is shown [s]."""

LiveEvent = tuple[float, int | list[int] | str]
"""A time [s], and the transition that fired, the transitions undone, or a failure in words."""


@dataclass(frozen=True, slots=True)
class LiveFrame:
    """The state at an instant, as sent to the page. `number`: of the frame; `run`: number of
    restarts; `poses`: positions [m] and quaternions (bodies, 7) as float32; `marked` places;
    `count`: number of events (firings and undos); `failed`: number of failures; `rhythm`: interval
    between the last two products [s]; `pace`: simulated seconds per second; `note`: the present
    trouble or the last failures, if any; `pushed`: the effect of the last push."""

    number: int
    run: int
    time: float
    poses: bytes = field(repr=False)
    marked: tuple[int, ...] = field(repr=False)
    count: int
    failed: int
    products: int
    rhythm: float | None
    playing: bool
    speed: float
    pace: float
    slowed: dict[int, float]
    blocked: tuple[str, ...]
    outages: Outages
    note: str
    pushed: str


class WallClock:
    """Real time against simulated time, which passes `speed` times as fast; 0: without limit.
    `begun`, `marks`: pairs (real, simulated) [s], at the start and recently."""

    speed = 1.0

    def start(self, time: float) -> None:
        """Restart at a simulated time."""
        self.begun = perf_counter(), time
        self.marks = deque([self.begun], maxlen=int(RATE))

    def mark(self, time: float) -> None:
        """The run has come to a simulated time."""
        self.marks.append((perf_counter(), time))

    def due(self) -> float:
        """The simulated time to which the run should have come."""
        wall, time = self.begun
        return time + (perf_counter() - wall) * self.speed

    @property
    def pace(self) -> float:
        """Simulated seconds a second, recently."""
        (wall, time), (now, reached) = self.marks[0], self.marks[-1]
        return (reached - time) / (now - wall) if now > wall else 0.0


class Session:
    """Runs the simulation that `make` returns, a new one after each restart; with a `campaign` it
    recovers from failures, and robots can be paused and killed. `run` ends with an exception of an
    observer. `frame` may be read, `send` and `wait` called from any thread."""

    def __init__(
        self,
        make: Callable[[], Simulation],
        playing: bool = True,
        campaign: Campaign | None = None,
    ) -> None:
        self._make: Callable[[], Interventions] = lambda: Interventions(make(), campaign)
        self._clock = WallClock()
        self._commands: SimpleQueue[Command] = SimpleQueue()
        self._changed = Condition()
        self._playing, self._stepping = playing, False
        self._number = self._runs = 0
        self._begin()
        self._publish()

    def _begin(self) -> None:
        self.interventions = self._make()
        recovery = self.interventions.recovery
        self._watch = Watch(recovery) if recovery else None
        self._trouble = ""
        self._clock.start(self.simulation.world.time)

    @property
    def simulation(self) -> Simulation:
        """The running simulation."""
        return self.interventions.simulation

    @property
    def fails(self) -> bool:
        """Whether it recovers from failures."""
        return self.interventions.recovery is not None

    @property
    def bodies(self) -> NDArray[np.intp]:
        """Numbers of the bodies that can move."""
        return np.flatnonzero(self.simulation.physical.m.body_treeid >= 0)

    def send(self, command: Command) -> None:
        """Queue a command, which is executed between ticks."""
        self._commands.put(command)

    def wait(self, number: int, timeout: float) -> LiveFrame:
        """The newest frame, as soon as one later than `number` exists."""
        with self._changed:
            self._changed.wait_for(lambda: self.frame.number > number, timeout)
            return self.frame

    def fired(self, run: int, since: int, until: int) -> list[LiveEvent]:
        """A slice of the firings and undos of a run; empty for a run that is over."""
        if run != self._runs:
            return []
        numbers = self.simulation.layout.factory.net.threaded.net.transition_index
        events = self.simulation.supervisor.events[since:until]
        return [
            (round(e.t, 4), [numbers[name] for name in e.transitions])
            if isinstance(e, Undone)
            else (round(e.t, 4), numbers[e.transition])
            for e in events
        ]

    def failed(self, run: int, since: int, until: int) -> list[LiveEvent]:
        """A slice of the failures of a run; empty for a run that is over."""
        failures = self._failures[since:until] if run == self._runs else ()
        return [(round(failing.t, 4), str(failing)) for failing in failures]

    @property
    def _failures(self) -> Sequence[Failing]:
        account = self.simulation.world.hooks.account
        return account.found if account else ()

    def run(self, observe: Observer) -> None:
        """Run without end; `observe` is called after every tick, and repeatedly while paused."""
        while True:
            begun = perf_counter()
            ran = self._advance(begun, observe) if self._goes else 0
            observe(self.simulation.state())
            if ran:
                self._publish()
            rest = 1 / RATE - (perf_counter() - begun) if self._clock.speed else 0.0
            if self._execute(max(rest, 0.0) if self._goes else LOOK):
                self._publish()

    @property
    def _goes(self) -> bool:
        return (self._playing or self._stepping) and not self._trouble

    def _advance(self, begun: float, observe: Observer) -> int:
        """Run ticks until simulated time has caught up, or a frame is due; returns their number."""
        supervisor, world, clock = self.simulation.supervisor, self.simulation.world, self._clock
        count = 0
        while self._goes:
            due = clock.due()
            if clock.speed and not self._stepping and world.time >= due:
                break
            if count and perf_counter() - begun >= 1 / RATE:
                if due - world.time > BEHIND * max(clock.speed, 1.0):
                    clock.begun = perf_counter(), world.time
                break
            before = len(supervisor.events)
            (supervisor.coast if world.dropped else supervisor.step)()
            observe(self.simulation.state())
            count += 1
            if reason := world.unstable():
                self._trouble = f"{reason}: restart it"
                break
            for act in world.hooks.ticks:
                act()
            if (trouble := world.hooks.trouble) is not None:
                self._trouble = f"{trouble.message}: restart it"
            elif (drop := world.dropped) and drop.is_seen(world.time):
                self._trouble = f"{drop.diagnostic.message}: restart it"
            elif self._stepping and len(supervisor.events) > before:
                self._stepping = self._playing = False
        clock.mark(world.time)
        return count

    def _execute(self, timeout: float) -> bool:
        """Execute the queued commands, waiting for one up to `timeout` [s]; returns whether there
        was one."""
        executed = False
        while True:
            try:
                command = self._commands.get(not executed and timeout > 0, timeout)
            except Empty:
                return executed
            self._do(command)
            executed = True

    def _do(self, command: Command) -> None:
        hands = self.interventions
        match command.do:
            case "pause":
                self._playing = self._stepping = False
            case "play":
                self._playing, self._stepping = True, False
            case "step":
                self._stepping, self._playing = True, False
            case "restart":
                self._runs += 1
                self._begin()
            case "speed":
                self._clock.speed = command.factor
            case "push":
                hands.push(command.robot, command.share, PUSH)
            case "slow":
                hands.slow(command.robot, command.factor)
            case "block":
                (hands.block if command.blocked else hands.free)(command.part)
            case "down":
                hands.fail("down", command.robot, seconds=LASTS)
            case "dead":
                hands.fail("dead", command.robot)
        self._clock.start(self.simulation.world.time)

    def _publish(self) -> None:
        world, supervisor, bodies = (
            self.simulation.physical,
            self.simulation.supervisor,
            self.bodies,
        )
        # shells follow one step after the body that has been put somewhere
        whole = world.parts.masks.trunk[bodies]
        poses = np.hstack([world.d.xpos[whole], world.d.xquat[whole]])
        left, outages = world.dropoffs, self._watch.now() if self._watch else Outages()
        self._number += 1
        frame = LiveFrame(
            self._number,
            self._runs,
            round(world.time, 4),
            poses.astype("<f4").tobytes(),
            self._marked(),
            len(supervisor.events),
            len(self._failures),
            world.delivered(),
            round(left[-1] - left[-2], 4) if len(left) > 1 else None,
            self._playing or self._stepping,
            self._clock.speed,
            round(self._clock.pace, 3),
            dict(self.interventions.slowed),
            tuple(sorted(self.interventions.blocked)),
            outages,
            self._trouble or self._failed() or ("" if any(outages.messages()) else self._waits()),
            self._pushed(),
        )
        with self._changed:
            self.frame = frame
            self._changed.notify_all()

    def _marked(self) -> tuple[int, ...]:
        """The marked places of the net."""
        marked = np.frombuffer(self.simulation.supervisor.marked, np.uint8)
        return tuple(np.flatnonzero(marked).tolist())

    def _failed(self) -> str:
        """The failures of the last SHOWN seconds, the latest last."""
        since = self.simulation.world.time - SHOWN
        recent = (failing for failing in self._failures[-3:] if failing.t > since)
        return "; ".join(f"{failing.t:.2f} s: {failing}" for failing in recent)

    def _pushed(self) -> str:
        """The effect of a recent push: robot, force and displacement."""
        push = self.interventions.pushed
        if push is None or self.simulation.world.time > push.end + SHOWN:
            return ""
        name = self.simulation.layout.factory.robots[push.robot].name
        way = "ahead" if push.force > 0 else "back"
        pushed = f"pushed {way} with {abs(push.force):.0f} N"
        if not self._goes:
            return f"{name} is {pushed} when the run continues"
        return f"{name} was {pushed} and displaced by {1000 * push.gave:.1f} mm"

    def _waits(self) -> str:
        """The waiting robots, where nothing has fired for a long time."""
        supervisor, silent = self.simulation.supervisor, self.simulation.silent
        if silent < QUIET * max(self.simulation.delays):
            return ""
        robots = self.simulation.layout.factory.robots
        words = [
            f"{robots[o.carrier].name} {'at' if o.inputs else 'for the feeder of'} {o.label}"
            for o in supervisor.awaited()[:4]
        ]
        waiting = "; ".join(words) or "no robot can start"
        return f"nothing has fired for {silent:.0f} s; waiting: {waiting}"
