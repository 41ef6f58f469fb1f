"""MagBotSim's movers under its own impedance controllers: MOVERS TIMESTEP SECONDS, where the last
is the wall time of each measurement.

The circle is that of its six-degree platform example; the stiffnesses are those of its planning
environment, in the plane as upwards. Those of the platform are unstable at 2 ms: the controller
takes a mover's mass for its inertia when it chooses the damping."""

import json
import sys
from importlib.metadata import version
from math import ceil, cos, sin, sqrt
from time import perf_counter

import mujoco
import numpy as np
from magbotsim import BasicMagBotEnv, MoverImpedanceController

TILE, HOVER, RADIUS, OMEGA = 0.24, 0.002, 0.08, 1.0
"""Its tiles, its height, and the circle and angular speed of its example [m, rad/s]."""

SETTLE = 0.1
"""Simulated before anything is measured [s]."""


class Movers(BasicMagBotEnv):
    """A mover on each tile of a square, with a ring of tiles round it."""

    def __init__(self, movers: int, timestep: float) -> None:
        side = ceil(sqrt(movers))
        row, column = np.divmod(np.arange(movers), side)
        self.centre = TILE * (np.column_stack([row, column]) + 1.5)
        self.controllers: list[MoverImpedanceController] = []
        self.timestep = timestep
        super().__init__(
            layout_tiles=np.ones((side + 2, side + 2)),
            num_movers=movers,
            initial_mover_zpos=HOVER,
            initial_mover_start_xy_pos=self.centre,
            render_mode=None,
        )
        self.controllers = [
            MoverImpedanceController(
                model=self.model,
                mover_joint_name=name,
                mover_half_height=self.mover_size[number, 2],
                translational_stiffness=np.array([100.0, 100.0, 100.0]),
                rotational_stiffness=np.array([0.1, 0.1, 1.0]),
            )
            for number, name in enumerate(self.mover_joint_names)
        ]
        self._reload()

    def _reload(self) -> None:
        """Once more, with actuators: as its examples do."""
        drives = [c.generate_actuator_xml_string(n) for n, c in enumerate(self.controllers)]
        xml = self.generate_model_xml_string(
            mover_start_xy_pos=self.centre,
            mover_goal_xy_pos=None,
            custom_xml_strings={
                "custom_outworldbody_xml_str": f"<actuator>{''.join(drives)}</actuator>"
            },
        )
        self.model = mujoco.MjModel.from_xml_string(xml)
        self.model.opt.timestep = self.timestep
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        self.update_cached_mover_mujoco_data()
        for controller in self.controllers:
            controller.update_cached_mujoco_data(self.model)

    def cycle(self, checked: bool) -> float:
        """One control cycle, and the seconds of it in the engine's step."""
        model, data = self.model, self.data
        angle = OMEGA * data.time
        away = RADIUS * np.array([cos(angle) - 1.0, sin(angle)])
        for centre, controller in zip(self.centre, self.controllers, strict=True):
            goal = np.array([*(centre + away), HOVER])
            controller.update(model, data, goal, np.array([1, 0, 0, 0]))
        begin = perf_counter()
        mujoco.mj_step(model, data, nstep=1)
        engine = perf_counter() - begin
        if checked:
            self.check_wall_collision(self.mover_names, self.c_size, False, None, True)
            self.check_mover_collision(self.mover_names, self.c_size, False, None, True)
        return engine

    def error(self) -> float:
        """How far the mover that is furthest from its goal is from it [m]."""
        angle = OMEGA * self.data.time
        goal = np.full((self.num_movers, 3), HOVER + self.mover_size[0, 2])
        goal[:, :2] = self.centre + RADIUS * np.array([cos(angle) - 1.0, sin(angle)])
        found = self.get_mover_qpos(self.mover_names).reshape(-1, 7)[:, :3]
        return float(np.linalg.norm(found - goal, axis=1).max())


def timed(movers: Movers, checked: bool, seconds: float) -> dict[str, float]:
    """As many cycles as fit into some seconds of wall time."""
    start, begin, engine = movers.data.time, perf_counter(), 0.0
    while perf_counter() - begin < seconds:
        engine += movers.cycle(checked)
    wall = perf_counter() - begin
    simulated = movers.data.time - start
    assert not any(warning.number for warning in movers.data.warning), "it is unstable"
    return {"realtime": simulated / wall, "simulated_s": simulated, "engine_share": engine / wall}


def main() -> None:
    count, timestep, seconds = int(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3])
    movers = Movers(count, timestep)
    while movers.data.time < SETTLE:
        movers.cycle(False)
    plain, checked = (timed(movers, c, seconds) for c in (False, True))
    assert movers.error() < RADIUS, f"the movers don't follow: {movers.error()} m off"
    found = {
        "movers": count,
        "timestep_s": timestep,
        "bodies": movers.model.nbody,
        "dofs": movers.model.nv,
        "contacts": movers.data.ncon,
        "error_m": movers.error(),
        "versions": f"MagBotSim {version('magbotsim')} on MuJoCo {mujoco.__version__}",
        "plain": plain,
        "checked": checked,
    }
    print(json.dumps(found))


if __name__ == "__main__":
    main()
