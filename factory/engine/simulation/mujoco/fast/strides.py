"""Several ticks in one call of the engine, courses that are planned once, and a broad phase that
looks at what can meet.

Steady production repeats itself to the last bit, so after some cycles every course has been planned
before. A call of many steps goes back to where it began if anything touched in it, and is taken
again step by step, since contacts are inspected in every step; so it does if a robot has left its
way, where it might touch something that was left out.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable

from factory.engine.simulation.mujoco.courses import Course
from factory.engine.simulation.mujoco.fast.neighbours import Neighbours
from factory.engine.simulation.mujoco.inspection import Inspection
from factory.engine.simulation.mujoco.stepping import SingleSteps
from factory.engine.simulation.world import Hooks
from factory.support.arrays import Index
from factory.support.engine import mujoco
from factory.support.settings import Settings

ROOM = 15_000_000
"""So many numbers of courses are kept, of 8 bytes each: twice those of the cycles of 1,000
robots. All are forgotten when there is no room for more."""


class Strides(SingleSteps):
    """Up to a stride of ticks in one call."""

    def __init__(
        self,
        m: mujoco.MjModel,
        d: mujoco.MjData,
        inspection: Inspection,
        hooks: Hooks,
        settings: Settings,
        neighbours: Neighbours,
    ) -> None:
        super().__init__(m, d, inspection, hooks, settings)
        self._neighbours = neighbours
        self.at_once = settings.stride
        self._before = mujoco.MjData(m)
        self._courses: dict[Hashable, Course] = {}
        self._room = ROOM

    def turn(self, active: Index) -> None:
        """The broad phase looks at what moves and what that can meet."""
        self._neighbours.turn(active)

    def follow(self, axes: Index, course: Course) -> None:
        """What that can meet is what is near its way."""
        self._neighbours.follow(axes, course.x)

    def take(self, steps: int) -> None:
        """Some timesteps: at once, and one by one where anything touches or leaves its way."""
        d = self.d
        self._neighbours.look()
        if d.ncon or self.hooks.each_step or self._neighbours.astray():
            self._neighbours.everything()
        if d.ncon or self.hooks.each_step or steps == 1:
            super().take(steps)
            return
        mujoco.mj_copyData(self._before, self.m, d)
        d.maxuse_con = 0
        self.step(steps)
        if d.maxuse_con or self._neighbours.astray():
            mujoco.mj_copyData(d, self.m, self._before)
            self._neighbours.everything()
            super().take(steps)

    def course(self, begin: Hashable, make: Callable[[], Course]) -> Course:
        """That of before, or it is planned now."""
        course = self._courses.get(begin)
        if course is None:
            course = make()
            size = course.setpoints.size + course.x.size + course.v.size
            if size > self._room:
                self._courses.clear()
                self._room = ROOM
            self._room -= size
            self._courses[begin] = course
        return course
