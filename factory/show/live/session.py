"""A factory that runs in step with real time, and obeys commands between ticks."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from threading import Condition
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from factory.nets.undo import marking_after
from factory.nets.undone import Undone
from factory.record.failures import Failing
from factory.show.live.commands import FAULTS, LASTS, PUSH, Command
from factory.show.live.outages import Outages, Watch
from factory.simulation.disturbance.interventions import Interventions
from factory.simulation.recovery import Campaign
from factory.simulation.simulation import FALL, Observer, Simulation
from factory.simulation.supervisor import Supervisor

RATE = 30.0
"""Frames a second."""

BEHIND = 0.25
"""A run that is further behind the clock than this [s] does not catch up."""

QUIET = 3.0
"""Where nothing has fired for so many times the longest delay, a note says what waits for what."""

LOOK = 0.05
"""Interval at which a session that is paused looks for commands [s]."""


SAID = 6.0
"""How long a failure, and what a push did, is told [s]."""

Told = tuple[float, int | list[int] | str]
"""When [s], and which transition fired, or which were undone, or what failed, in words."""


@dataclass(frozen=True, slots=True)
class LiveFrame:
    """The state at an instant, as the page is told it. `number`: of the frame; `run`: number of
    restarts; `poses`: positions [m] and quaternions (bodies, 7) as float32; `marked` places;
    `count`: how often something has fired, or was undone; `failed`: how often something has failed;
    `rhythm`: between the last two products [s]; `pace`: simulated seconds in a second; `outages`:
    what is out of order; `note`: what has just gone wrong, if anything; `pushed`: what the last
    push did."""

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
    """Real time against simulated time, which passes `speed` times as fast; 0: as fast as it goes.
    `begun`, `marks`: pairs of both [s], at the start and recently."""

    def __init__(self, speed: float = 1.0) -> None:
        self.speed = speed

    def start(self, time: float) -> None:
        """Start anew at a simulated time."""
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
    """Runs what `make` gives, anew after each restart; with a `campaign` it goes on after failures,
    and can be made to fail. `run` ends with an exception of an observer. `frame` may be read,
    `send` and `wait` called from any thread."""

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
        """What runs."""
        return self.interventions.simulation

    @property
    def fails(self) -> bool:
        """Whether it goes on after failures."""
        return self.interventions.recovery is not None

    @property
    def joints(self) -> list[str] | None:
        """The labels of what is joined, where it goes on after failures; else None."""
        made = self.simulation.layout.factory.making
        return [o.label for o in made if len(o.inputs) > 1] if self.fails else None

    @property
    def bodies(self) -> NDArray[np.intp]:
        """The bodies that can move, by number."""
        return np.flatnonzero(self.simulation.physical.m.body_treeid >= 0)

    def send(self, command: Command) -> None:
        """Give a command, which is obeyed between ticks."""
        self._commands.put(command)

    def wait(self, number: int, timeout: float) -> LiveFrame:
        """The newest frame, as soon as there is one after `number`."""
        with self._changed:
            self._changed.wait_for(lambda: self.frame.number > number, timeout)
            return self.frame

    def fired(self, run: int, since: int, until: int) -> list[Told]:
        """What fired in a run and what was undone, some of it; none of a run that is over."""
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

    def failed(self, run: int, since: int, until: int) -> list[Told]:
        """What failed in a run, some of it; nothing of a run that is over."""
        found = self._found[since:until] if run == self._runs else ()
        return [(round(one.t, 4), str(one)) for one in found]

    @property
    def _found(self) -> Sequence[Failing]:
        account = self.simulation.world.hooks.account
        return account.found if account else ()

    def run(self, observe: Observer) -> None:
        """Run for ever; `observe` is called after every tick, and repeatedly while it is paused."""
        while True:
            begun = perf_counter()
            ran = self._advance(begun, observe) if self._goes else 0
            observe(self.simulation.world, self.simulation.supervisor)
            if ran:
                self._publish()
            rest = 1 / RATE - (perf_counter() - begun) if self._clock.speed else 0.0
            if self._obey(max(rest, 0.0) if self._goes else LOOK):
                self._publish()

    @property
    def _goes(self) -> bool:
        return (self._playing or self._stepping) and not self._trouble

    def _advance(self, begun: float, observe: Observer) -> int:
        """Run ticks until simulated time is what it should be, or a frame is due; gives their
        number."""
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
            observe(world, supervisor)
            count += 1
            if reason := world.unstable():
                self._trouble = f"{reason}: begin anew"
                break
            for act in world.hooks.ticks:
                act()
            if (trouble := world.hooks.trouble) is not None:
                self._trouble = f"{trouble.message}: begin anew"
            elif (drop := world.dropped) and world.time >= drop.time + FALL:
                self._trouble = f"{drop.diagnostic.message}: begin anew"
            elif self._stepping and len(supervisor.events) > before:
                self._stepping = self._playing = False
        clock.mark(world.time)
        return count

    def _obey(self, timeout: float) -> bool:
        """Obey the commands given, waiting for one up to `timeout` [s]; gives whether there was
        one."""
        obeyed = False
        while True:
            try:
                command = self._commands.get(not obeyed and timeout > 0, timeout)
            except Empty:
                return obeyed
            self._do(command)
            obeyed = True

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
            case kind:
                robot = command.robot if "robot" in FAULTS[kind] else None
                hands.fail(kind, robot, command.part or command.joint, LASTS)
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
            len(self._found),
            world.delivered(),
            round(left[-1] - left[-2], 4) if len(left) > 1 else None,
            self._playing or self._stepping,
            self._clock.speed,
            round(self._clock.pace, 3),
            dict(self.interventions.slowed),
            tuple(sorted(self.interventions.blocked)),
            outages,
            self._trouble or self._failed() or ("" if outages.told else self._waits()),
            self._pushed(),
        )
        with self._changed:
            self.frame = frame
            self._changed.notify_all()

    def _marked(self) -> tuple[int, ...]:
        """The places of the net that the page draws: that which the run began with. A deputy does
        the tours of a robot that is gone in their order, so the counts lead to a marking of it,
        with a token for either robot's tours."""
        supervisor, account = self.simulation.supervisor, self.simulation.world.hooks.account
        if not (account and account.exchanges and isinstance(supervisor, Supervisor)):
            return tuple(np.flatnonzero(np.frombuffer(supervisor.marked, np.uint8)).tolist())
        net = self.simulation.layout.factory.net
        return tuple(sorted(marking_after(net, supervisor.fired)))

    def _failed(self) -> str:
        """What has failed lately, and when, the latest last."""
        late = self.simulation.world.time - SAID
        return "; ".join(f"{one.t:.2f} s: {one}" for one in self._found[-3:] if one.t > late)

    def _pushed(self) -> str:
        """Which robot was pushed lately, with what force, and how far it gave way."""
        push = self.interventions.pushed
        if push is None or self.simulation.world.time > push.end + SAID:
            return ""
        name = self.simulation.layout.factory.robots[push.robot].name
        way = "ahead" if push.force > 0 else "back"
        pushed = f"pushed {way} with {abs(push.force):.0f} N"
        if not self._goes:
            return f"{name} is {pushed} as soon as the factory goes on"
        return f"{name} was {pushed} and gave way by {1000 * push.gave:.1f} mm"

    def _waits(self) -> str:
        """Which robots wait for what, where nothing has fired for a long time."""
        supervisor, silent = self.simulation.supervisor, self.simulation.silent
        if silent < QUIET * max(self.simulation.delays):
            return ""
        robots = self.simulation.layout.factory.robots
        words = [
            f"{robots[o.carrier].name} {'at' if o.inputs else 'for the feeder of'} {o.label}"
            for o in supervisor.awaited()[:4]
        ]
        waiting = "; ".join(words) or "no robot can start"
        return f"nothing has fired for {silent:.0f} s: waiting are {waiting}"
