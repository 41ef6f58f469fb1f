"""A factory that runs in step with the clock on the wall, and obeys commands between ticks."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from threading import Condition
from time import perf_counter
from typing import Any

import numpy as np

from factory.show.live.commands import (
    PUSH,
    Block,
    Command,
    Pause,
    Play,
    Push,
    Restart,
    Slow,
    Speed,
    Step,
)
from factory.simulation.disturbance.interventions import Interventions
from factory.simulation.simulation import Observer, Simulation

RATE = 30.0
"""Frames a second."""

BEHIND = 0.25
"""A run that is further behind the clock [s] does not try to make up for it."""

QUIET = 3.0
"""Where nothing has fired for so many times the longest delay, it is said who waits for what."""

LOOK = 0.05
"""While it stands still, a session looks for commands so often [s]."""


@dataclass(frozen=True, slots=True)
class Frame:
    """What is seen at an instant. `number`: frames are counted; `run`: how often it was begun anew;
    `poses`: positions [m] and quaternions (bodies, 7) as float32; `marked` places; `fired`: how
    many transitions have; `rhythm`: between the last two products [s]; `pace`: simulated seconds in
    a second; `note`: what is wrong, if anything."""

    number: int
    run: int
    time: float
    poses: bytes = field(repr=False)
    marked: tuple[int, ...] = field(repr=False)
    fired: int
    products: int
    rhythm: float | None
    playing: bool
    speed: float
    pace: float
    slowed: dict[int, float]
    blocked: tuple[str, ...]
    note: str


class Session:
    """Runs what `make` gives, again and again if asked; `run` goes on until it is stopped by an
    exception of an observer. `frame` may be read, `send` and `wait` called from any thread."""

    def __init__(self, make: Callable[[], Simulation], playing: bool = True) -> None:
        self._make = make
        self._commands: SimpleQueue[Command] = SimpleQueue()
        self._changed = Condition()
        self._playing, self._stepping, self._speed = playing, False, 1.0
        self._number = self._runs = 0
        self._start = 0.0, 0.0
        self._begin()
        self._publish()

    def _begin(self) -> None:
        self.simulation = made = self._make()
        self.interventions = Interventions(made)
        net = made.layout.factory.net.threaded
        self._numbers = {t.name: n for n, t in enumerate(net.transitions)}
        m = made.physical.m
        self.bodies = np.flatnonzero(m.body_treeid >= 0)
        self._quiet = QUIET * max(made.delays)
        self._trouble = ""
        self._anchor()

    def send(self, command: Command) -> None:
        """Have a command obeyed, soon."""
        self._commands.put(command)

    def wait(self, number: int, timeout: float) -> Frame:
        """The newest frame, as soon as there is one after `number`."""
        with self._changed:
            self._changed.wait_for(lambda: self.frame.number > number, timeout)
            return self.frame

    def fired(self, run: int, since: int, until: int) -> list[tuple[float, int]]:
        """Time [s] and transition of some of the firings of a run; none of one that is over."""
        if run != self._runs:
            return []
        events = self.simulation.supervisor.events[since:until]
        return [(round(e.t, 4), self._numbers[e.transition]) for e in events]

    def run(self, observe: Observer) -> None:
        """Go on for ever; `observe` is called after every tick, and while nothing moves."""
        while True:
            begun = perf_counter()
            ran = self._advance(begun, observe) if self._goes else 0
            observe(self.simulation.world, self.simulation.supervisor)
            if ran:
                self._publish()
            rest = 1 / RATE - (perf_counter() - begun) if self._speed else 0.0
            if self._obey(max(rest, 0.0) if self._goes else LOOK):
                self._publish()

    @property
    def _goes(self) -> bool:
        return (self._playing or self._stepping) and not self._trouble

    def _advance(self, begun: float, observe: Observer) -> int:
        """Ticks until the run is where the clock on the wall is, or a frame is due; gives how
        many."""
        supervisor, world = self.simulation.supervisor, self.simulation.world
        count = 0
        while self._goes:
            now = perf_counter()
            due = self._start[1] + (now - self._start[0]) * self._speed
            if self._speed and not self._stepping and world.time >= due:
                break
            if count and now - begun >= 1 / RATE:
                if due - world.time > BEHIND * max(self._speed, 1.0):
                    self._start = now, world.time
                break
            before = len(supervisor.events)
            supervisor.step()
            observe(world, supervisor)
            count += 1
            if reason := world.unstable():
                self._trouble = f"{reason}: begin anew"
            elif self._stepping and len(supervisor.events) > before:
                self._stepping = self._playing = False
        self._paces.append((perf_counter(), world.time))
        return count

    def _obey(self, timeout: float) -> bool:
        """Do what is asked; waits so long for it. Gives whether anything was."""
        obeyed = False
        while True:
            try:
                command = self._commands.get(not obeyed and timeout > 0, timeout)
            except Empty:
                return obeyed
            self._do(command)
            obeyed = True

    def _do(self, command: Command) -> None:
        match command:
            case Pause():
                self._playing = self._stepping = False
            case Play():
                self._playing, self._stepping = True, False
            case Step():
                self._stepping, self._playing = True, False
            case Restart():
                self._runs += 1
                self._begin()
            case Speed(factor):
                self._speed = factor
            case Push(robot, share):
                self.interventions.push(robot, share, PUSH)
            case Slow(robot, factor):
                self.interventions.slow(robot, factor)
            case Block(part, blocked):
                (self.interventions.block if blocked else self.interventions.free)(part)
        self._anchor()

    def _anchor(self) -> None:
        """Time goes by from here and now."""
        self._start = perf_counter(), self.simulation.world.time
        self._paces: deque[tuple[float, float]] = deque([self._start], maxlen=int(RATE))

    def _publish(self) -> None:
        world, supervisor = self.simulation.physical, self.simulation.supervisor
        poses = np.hstack([world.d.xpos[self.bodies], world.d.xquat[self.bodies]])
        (wall, time), (now, reached) = self._paces[0], self._paces[-1]
        self._number += 1
        frame = Frame(
            self._number,
            self._runs,
            world.time,
            poses.astype("<f4").tobytes(),
            supervisor.marked(),
            len(supervisor.events),
            world.delivered(),
            round(left[-1] - left[-2], 4) if len(left := world.dropoffs) > 1 else None,
            self._playing or self._stepping,
            self._speed,
            (reached - time) / (now - wall) if now > wall else 0.0,
            dict(self.interventions.slowed),
            tuple(sorted(self.interventions.blocked)),
            self._trouble or self._waits(),
        )
        with self._changed:
            self.frame = frame
            self._changed.notify_all()

    def _waits(self) -> str:
        """Who waits for what, where nothing has fired for long."""
        supervisor: Any = self.simulation.supervisor
        silent = self.simulation.world.time - supervisor.last_event
        if silent < self._quiet:
            return ""
        robots = self.simulation.layout.factory.robots
        words = [
            f"{robots[o.carrier].name} {'at' if o.inputs else 'for the feeder of'} {o.label}"
            for o in supervisor.awaited()[:4]
        ]
        who = "; ".join(words) or "no robot can start"
        return f"nothing has fired for {silent:.0f} s: waiting are {who}"
