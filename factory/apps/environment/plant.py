"""The environment: observations, actions and rewards of an agent that drives a plant."""

from __future__ import annotations

from math import inf
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from factory.api import Picture, Simulation
from factory.apps.plc.driven import drive
from factory.apps.plc.signals import Commands, Sensed
from factory.film.film import Glimpses
from factory.support.errors import usage_error

PICTURE = Picture((640, 480), caption=False)
"""How `render` takes pictures."""

BEYOND = 1.0
"""No axis is seen further than this outside its way [m]."""

FASTEST = 100.0
"""Nor faster than this [m/s]."""

SEEDS = 2**31
"""A run's seed is drawn below this."""

EnvObservation = dict[str, Any]
EnvAction = dict[str, Any]
"""An array for each name of its space."""


class FactoryEnv(gymnasium.Env[EnvObservation, EnvAction]):
    """A factory over MuJoCo whose plant an agent commands as a PLC does; one episode makes `units`
    products.

    The plant's interlock fires the transitions of the net, keeps each axis within its corridor, and
    refuses what the net does not allow, by name in `info["refused"]`. Where bodies touch that
    should not, or a part is dropped, all axes stand for good (`info["tripped"]`). A step lets
    `interval` pass.

    An action has, with A axes, R robots and N operations:

    - `setpoint` (A,): where each axis is to go and stay [m; rad for a tool that turns].
    - `grip` (R,): 1 closes a robot's grip, 0 opens it.
    - `job` (R,): the number of the operation that a robot is in, from 1, in the order of
      `factory.operations`; 0 for none. The carrier of an operation takes it up first, which starts
      it, and gives it up when its parts have changed hands, which ends it.

    An observation has:

    - `position`, `speed` (A,): of the axes [m, m/s; rad, rad/s].
    - `low`, `high` (A,): the corridor of each axis now; setpoints outside are clipped to it.
    - `held` (R,): whether a grip holds something.
    - `job` (R,): the jobs as they are.
    - `marked` (P,): the marking of the net.
    - `legal` (R, N + 1): the mask of the jobs that each robot may have in the next action: the
      one that it has, 0 as soon as it may give that up, and for a robot without a job those that
      it may take up.

    The reward is the number of products that left in the step. An episode ends when all are made,
    and is cut off (`truncated`) after `max_time`, or where the plant has tripped.

    Args:
        first: a run that has not begun; each episode is another of the same, with a seed that is
            drawn at its reset. Environments may share it: what it compiles is shared then.
        interval: time of a step [s], rounded to whole ticks.
        max_time: longest episode [s of simulated time].
        render_mode: `rgb_array`, or None.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}  # noqa: RUF012 (Gymnasium's form)

    def __init__(
        self,
        first: Simulation,
        interval: float = 0.1,
        max_time: float = 300.0,
        render_mode: str | None = None,
    ) -> None:
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise usage_error(f"render_mode {render_mode!r}", "there is 'rgb_array', or None")
        if not (0.0 < interval < max_time < inf):
            message = f"a step of {interval} s in an episode of at most {max_time} s"
            raise usage_error(message, "give 0 < interval < max_time, for example 0.1 and 300")
        self.render_mode, self._max_time = render_mode, max_time
        self._glimpses: Glimpses | None = None
        self.factory, self.simulation, self._first = first.layout.factory, first, first
        layout, tick = first.layout, first.request.settings.tick
        self._ticks = max(1, round(interval / tick))
        self._interval = self._ticks * tick
        count = len(layout.guidepaths)
        ways = [path.length for path in layout.guidepaths]
        ways += [high for _, high in layout.spans[count:]]
        axes, robots = len(ways), len(self.factory.robots)
        operations = len(self.factory.operations)
        self.action_space = spaces.Dict(
            {
                "setpoint": spaces.Box(np.zeros(axes), np.array(ways), dtype=np.float64),
                "grip": spaces.MultiBinary(robots),
                "job": spaces.MultiDiscrete([operations + 1] * robots),
            }
        )
        near = spaces.Box(np.full(axes, -BEYOND), np.array(ways) + BEYOND, dtype=np.float64)
        self.observation_space = spaces.Dict(
            {
                **dict.fromkeys(("position", "low", "high"), near),
                "speed": spaces.Box(-FASTEST, FASTEST, (axes,), np.float64),
                "held": spaces.MultiBinary(robots),
                "job": spaces.MultiDiscrete([operations + 1] * robots),
                "marked": spaces.MultiBinary(len(self.factory.net.threaded.places)),
                "legal": spaces.MultiBinary([robots, operations + 1]),
            }
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[EnvObservation, dict[str, Any]]:
        """Begin an episode: the factory is empty, all robots are at home. `options` has no meaning
        yet."""
        super().reset(seed=seed)
        self.close()
        self.simulation = self._first.again(int(self.np_random.integers(SEEDS)))
        self.simulation.world.hooks.busy = float("inf")
        self._commands = _Given(len(self.factory.robots))
        self._driven = drive(self.simulation, self._commands, self._interval)
        self._commands.now = self._driven.interlock.commands
        self._told = 0
        return self._seen(), self._info()

    def step(self, action: EnvAction) -> tuple[EnvObservation, float, bool, bool, dict[str, Any]]:
        """Command the plant, and let a step's time pass."""
        world = self.simulation.world
        before = world.delivered()
        self._commands.now = Commands(
            np.array(action["setpoint"], float),
            tuple(map(bool, action["grip"])),
            tuple(map(int, action["job"])),
        )
        for _ in range(self._ticks):
            (self._driven.coast if world.dropped else self._driven.step)()
        made = world.delivered()
        ended = made >= self.simulation.request.units
        cut_off = not ended and (world.time >= self._max_time or self._driven.tripped)
        return self._seen(), float(made - before), ended, cut_off, self._info()

    def render(self) -> Any:
        """A picture (height, width, 3); None without a `render_mode`."""
        if self.render_mode is None:
            return None
        if self._glimpses is None:
            self._glimpses = Glimpses(self.simulation, PICTURE)
        return self._glimpses.draw()

    def close(self) -> None:
        """Give the renderer's GL context back."""
        if self._glimpses is not None:
            self._glimpses.close()
            self._glimpses = None

    def _seen(self) -> EnvObservation:
        interlock = self._driven.interlock
        sensed = self._driven.sensed()
        low, high = self._driven.corridor()
        return {
            "position": sensed.position.copy(),
            "speed": sensed.speed.copy(),
            "low": low,
            "high": high,
            "held": np.array(sensed.held, np.int8),
            "job": np.array(interlock.commands.job, np.int64),
            "marked": np.frombuffer(bytes(interlock.marked), np.int8).copy(),
            "legal": interlock.legal_jobs().astype(np.int8),
        }

    def _info(self) -> dict[str, Any]:
        refused = self._driven.interlock.refusals
        new, self._told = refused.since(self._told), refused.count
        return {
            "time": float(self.simulation.world.time),
            "products": self.simulation.world.delivered(),
            "refused": [refusal.message for refusal in new],
            "tripped": self._driven.tripped,
        }


class _Given:
    """A controller whose outputs are set from outside."""

    def __init__(self, robots: int) -> None:
        self.now = Commands(np.zeros(0), (False,) * robots, (0,) * robots)

    def scan(self, sensed: Sensed) -> Commands:
        """The outputs that were set last."""
        return self.now
