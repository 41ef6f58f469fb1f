"""The interlock of a driven plant: it carries out the commands that the marking, the order places
and the reach of grips allow, and refuses all others by name. It does not trust the controller or
know how it decides."""

from __future__ import annotations

import numpy as np

from factory.api import NOPART, Event, Mode, Operation, Simulation
from factory.apps.plc.corridors import Corridors
from factory.apps.plc.signals import Commands, GripStates, Refusal, Refusals
from factory.support.arrays import Truth

REACH = 1e-3
"""Greatest distance of an axis from where parts change hands at which a grip takes a part [m]."""


class PlantInterlock:
    """Carries out commands in the world of a simulation that has not begun. It fires X_s when the
    carrier of X takes the job up, and X_e when it gives it up. `ordering`: the order places that it
    keeps; `corridors`: where axes may go; `fired`: firing counts of the transitions; `held_back`:
    robots that stand because their last command is refused; `refusals`: the refused commands."""

    def __init__(self, simulation: Simulation) -> None:
        layout, world = simulation.layout, simulation.world
        self.factory, self.world = layout.factory, world
        self.ordering, self.corridors = simulation.supervisor.ordering, Corridors(simulation.timing)
        self._goals = [mode.goals for mode in simulation.modes]
        gears, starts = layout.factory.net, [o.start for o in layout.factory.operations]
        self.threads = gears.threads(gears.initial_marking, starts)
        self.fired = [0] * len(gears.threaded.transitions)
        self.events: list[Event] = []
        self.refusals = Refusals()
        robots = len(layout.factory.robots)
        self.grips, self.held_back = GripStates(robots), set[int]()
        self.commands = Commands(world.sense()[0].copy(), (False,) * robots, (0,) * robots)

    @property
    def marked(self) -> bytearray:
        """1 for each place that is marked, 0 for the others."""
        return self.threads.marked

    def held(self, robot: int) -> bool:
        """Whether the sensor of a robot's grip reports a payload."""
        return self.grips.held(robot, self.commands.grip[robot])

    def ready(self, operation: Operation) -> bool:
        """Whether a robot that waits at a station may take the part, or drop the product off."""
        if operation.start not in self.threads.possible:
            return False
        unit = self.factory.unit(operation, self.fired[operation.start])
        return self.world.prepared(operation, unit)

    def carry_out(self, now: Commands) -> None:
        """Apply the changes between the last commands and these: jobs given up, grips opened, jobs
        taken up (carriers first), grips closed. A controller may scan more often."""
        before, self.commands = self.commands, now
        robots = range(len(self.factory.robots))
        jobs = [robot for robot in robots if now.job[robot] != before.job[robot]]
        grips = [robot for robot in robots if now.grip[robot] != before.grip[robot]]
        self.held_back.difference_update(jobs, grips)
        for robot in jobs:
            if (left := self._operation(before.job[robot])) is not None:
                self._leave(robot, left)
        for robot in grips:
            if not now.grip[robot]:
                self._open(robot)
        for robot in sorted(jobs, key=self._follows):
            if now.job[robot]:
                self._enter(robot, now.job[robot])
        for robot in grips:
            if now.grip[robot]:
                self._close(robot)

    # jobs

    def _operation(self, job: int) -> Operation | None:
        """The operation of a job; None for no job."""
        operations = self.factory.operations
        return operations[job - 1] if 1 <= job <= len(operations) else None

    def _follows(self, robot: int) -> bool:
        """Whether a robot is not the carrier of its job: carriers start first."""
        operation = self._operation(self.commands.job[robot])
        return operation is None or operation.carrier != robot

    def _enter(self, robot: int, job: int) -> None:
        """A robot takes a job up. If it is the carrier, the operation starts."""
        name, operation = self.factory.robots[robot].name, self._operation(job)
        if operation is None:
            self._refuse(robot, f"{name} takes up job {job}: there is no such operation")
        elif robot not in operation.robots:
            self._refuse(robot, f"{name} has no part in {_name(operation)}")
        elif robot in self.grips.closed:
            what = f"{name} takes up {_name(operation)} before its grip has opened"
            self._refuse(robot, what)
        elif robot != operation.carrier:
            if not self.marked[operation.place]:
                what = f"{name} takes up {_name(operation)} before its carrier does"
                self._refuse(robot, what)
        elif why := self.obstacle(operation):
            self._refuse(robot, f"{name} takes up {_name(operation)}, but {why}")
        else:
            self._fire(operation, operation.start)

    def obstacle(self, operation: Operation) -> str:
        """Why an operation cannot start; "" if it can."""
        if operation.start not in self.threads.possible:
            places = self.factory.net.threaded.net.preset[operation.start]
            absent = [
                self.factory.robots[robot].name
                for robot in operation.robots
                if not any(
                    self.marked[p] for p in places if p in self.factory.net.gears[robot].places
                )
            ]
            are = "is" if len(absent) == 1 else "are"
            return f"{' and '.join(absent)} {are} not there with what is brought"
        if not self.ready(operation) and (
            not operation.inputs or self.factory.drops(operation.index)
        ):
            return "its feeder shows no part" if not operation.inputs else "the outfeed is not free"
        self.ordering.ask_anew()
        sense = self.world.sense
        if self.ordering.hold_up(operation.start, self.fired.__getitem__, lambda: sense()[0]):
            return "another machine is still in its way"
        return ""

    def _leave(self, robot: int, operation: Operation) -> None:
        """A robot gives a job up. If it is the carrier, the operation ends and parts change
        hands."""
        name = self.factory.robots[robot].name
        if robot in self.grips.closed:
            what = f"{name} leaves {_name(operation)} before its grip has opened"
            self._refuse(robot, what)
        if robot != operation.carrier or not self.marked[operation.place]:
            return
        if why := self.unfinished(operation):
            self._refuse(robot, f"{name} ends {_name(operation)}, but {why}")
        else:
            self._fire(operation, operation.end)
            self.grips.hand_over(operation)

    def unfinished(self, operation: Operation) -> str:
        """Why an operation cannot end; "" if it can."""
        robot = operation.carrier
        held = self.held(robot)
        if held != (operation.after[operation.robots.index(robot)] != NOPART):
            return f"its grip {'is closed' if held else 'is open'}"
        return self._far(operation) or self._moving(operation)

    def legal_jobs(self) -> Truth:
        """Which jobs each robot may have in the next commands, 0 for none (robots, operations + 1):
        the one that it has, and those that it may take up now. One that is at work has no other
        before it may give its own up."""
        factory, jobs = self.factory, self.commands.job
        legal = np.zeros((len(factory.robots), len(factory.operations) + 1), bool)
        for robot, job in enumerate(jobs):
            operation = self._operation(job)
            legal[robot, job if operation else 0] = True
            if operation is not None:
                works = self.marked[operation.place] and robot in operation.robots
                leads = works and robot == operation.carrier
                closed = robot in self.grips.closed
                legal[robot, 0] = not closed and not (
                    self.unfinished(operation) if leads else works
                )
        for operation in factory.operations:
            starts = not self.marked[operation.place]
            for robot in operation.robots:
                free = not jobs[robot] and robot not in self.grips.closed
                if free and starts == (robot == operation.carrier):
                    legal[robot, operation.index + 1] = not (starts and self.obstacle(operation))
        return legal

    def _fire(self, operation: Operation, transition: int) -> None:
        job = operation, self.factory.unit(operation, self.fired[transition])
        self.threads.fire((transition,))
        self.fired[transition] += 1
        name = self.factory.net.threaded.transitions[transition].name
        self.events.append(Event(self.world.time, name))
        is_start = transition == operation.start
        self.world.apply([job] if is_start else [], [] if is_start else [job])

    # grips

    def _close(self, robot: int) -> None:
        """A grip closes. It takes what its robot's operation gives it, if that is within reach."""
        name, operation = self.factory.robots[robot].name, self._under_way(robot)
        if operation is None or operation.carrier != robot:
            if self.grips.label[robot] == NOPART:
                self._refuse(robot, f"{name} closes its grip where nothing is given to it")
        elif far := self._far(operation):
            self._refuse(robot, f"{name} closes its grip in {_name(operation)}, but {far}")
        else:
            self.grips.taken.add(robot)

    def _open(self, robot: int) -> None:
        """A grip opens. It releases what has been taken over from it, or drops the product off."""
        label, operation = self.grips.label[robot], self._under_way(robot)
        self.grips.closed.discard(robot)
        self.grips.taken.discard(robot)
        if label == NOPART:
            return
        drops = operation is not None and self.factory.drops(operation.index)
        far = self._far(operation) if drops and operation is not None else "nobody has taken it"
        if far:
            name = self.factory.robots[robot].name
            self._refuse(robot, f"{name} opens its grip: {label} would fall, since {far}")
        else:
            self.grips.freed.add(robot)

    def _under_way(self, robot: int) -> Operation | None:
        """The started operation that is a robot's job."""
        operation = self._operation(self.commands.job[robot])
        if operation is None or robot not in operation.robots:
            return None
        return operation if self.marked[operation.place] else None

    def _far(self, operation: Operation) -> str:
        """The axis that is out of a grip's reach from where parts change hands; "" for none."""
        axes = self.factory.moves[operation.index]
        away = np.abs(self.world.sense()[0][list(axes)] - self._goals[operation.index])
        worst = int(away.argmax())
        if away[worst] <= REACH:
            return ""
        robot = self.factory.robots[self.factory.robot_of(axes[worst])].name
        far, reach = 1000 * float(away[worst]), 1000 * REACH
        return f"{robot} is {far:.1f} mm from where it has to be, and a grip reaches {reach:g} mm"

    def _moving(self, operation: Operation) -> str:
        """The axis that is too fast for parts to change hands; "" for none."""
        axes = self.factory.moves[operation.index]
        speeds = np.abs(self.world.sense()[1][list(axes)])
        worst = int(speeds.argmax())
        if speeds[worst] <= Mode.REST:
            return ""
        robot = self.factory.robots[self.factory.robot_of(axes[worst])].name
        return f"{robot} still moves at {1000 * float(speeds[worst]):.0f} mm/s"

    def _refuse(self, robot: int, message: str) -> None:
        """Refuse a command: the robot stands until its job or grip command changes."""
        self.refusals.add(Refusal(self.world.time, robot, message))
        self.held_back.add(robot)


def _name(operation: Operation) -> str:
    return " ".join(dict.fromkeys((operation.template.name, operation.label)))
