"""The MuJoCo world: slide joints, actuators with force limits, parts as free bodies, welds.

At a transition the actuators' setpoints follow another mode's reference and the welds of the parts concerned
are switched; nothing is teleported, except a finished product's bodies returning out of sight.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from time import perf_counter

import mujoco
import numpy as np

from factory.control.governor import follow
from factory.control.mode import Array, Index
from factory.control.navigation import Bundle
from factory.errors import Diagnostic, InputError
from factory.factory import Operation
from factory.mjcf import names
from factory.mjcf.model import BITS, CARRIAGE_MASS, Model
from factory.world.inspection import Inspection
from factory.world.stock import Stock

AWAKE = -0.0
"""Written over a speed of zero it wakes a sleeping body and changes nothing else."""


class MujocoWorld:
    """A compiled model with its data, and the parts' whereabouts.

    `gains` (R,): factor on each robot's controller gain. Raises InputError (BadMesh) where the engine
    refuses the model, with the engine's own words.
    """

    def __init__(self, model: Model, start: Array, gains: Array, units: int) -> None:
        self.model, self.settings, self.units = model, model.settings, units
        self.m = load(model)
        self.d = mujoco.MjData(self.m)
        factory = model.factory
        joint = [self.m.joint(names.slide(r.name)).id for r in factory.robots]
        actuator = [self.m.actuator(names.drive(r.name)).id for r in factory.robots]
        self.qpos = self.m.jnt_qposadr[joint]
        self.dof = self.m.jnt_dofadr[joint]
        self.control = self.m.actuator_ctrladr[actuator]
        self.m.actuator_biasprm[actuator, 1:3] *= np.asarray(gains)[:, None]
        self.reference = np.array(start, float)
        self.speed = np.zeros_like(self.reference)
        self.mass = np.full(len(start), CARRIAGE_MASS)
        self.d.qpos[self.qpos] = start
        self.d.ctrl[self.control] = start
        self.stock = Stock(self.m, self.d, model, units)
        self.inspection = Inspection(self.m, self.d, model)
        self.physics_time = 0.0
        mujoco.mj_forward(self.m, self.d)

    @property
    def time(self) -> float:
        """[s]"""
        return float(self.d.time)

    @property
    def dropoffs(self) -> list[float]:
        """When each product left the outfeed [s]."""
        return self.stock.left

    def sense(self) -> tuple[Array, Array]:
        """Measured positions and speeds of all carriages."""
        return self.d.qpos[self.qpos], self.d.qvel[self.dof]

    def prepared(self, operation: Operation, unit: int) -> bool:
        """A feeder presents the part of that unit; the outfeed has room for a product."""
        if operation.index == self.model.factory.dropoff.index:
            return self.stock.outfeed_is_free()
        return bool(operation.inputs) or self.stock.presents(operation.label, unit)

    def apply(
        self, started: Sequence[tuple[Operation, int]], ended: Sequence[tuple[Operation, int]]
    ) -> None:
        """Hand the parts of ended operations over: welds off and on in one tick."""
        for operation, unit in ended:
            switched = self.stock.hand_over(operation, unit)
            self.inspection.handed_over(switched)
            for slot, robot in enumerate(operation.robots):
                self.mass[robot] = CARRIAGE_MASS + self.model.masses.get(operation.after[slot], 0.0)

    def step(self, bundle: Bundle | None, robots: Index) -> None:
        """One tick of the engine, the drives following a reference that obeys F_p under the limits."""
        dt, substeps = self.settings.timestep, self.settings.substeps
        d, m = self.d, self.m
        pos = self.control[robots]
        dof = self.dof[robots]
        if bundle is not None:
            x, v = self.reference[robots], self.speed[robots]
            x1, v1, a = follow(bundle, x, v, self.settings.tick)
            self.reference[robots], self.speed[robots] = x1, v1
            d.ctrl[pos + 2] = self.mass[robots] * a
        for k in range(substeps):
            if bundle is not None:
                tau = k * dt
                d.ctrl[pos] = x + v * tau + (0.5 * tau * tau) * a
                d.ctrl[pos + 1] = v + a * tau
                still = dof[d.qvel[dof] == 0.0]
                d.qvel[still] = AWAKE
            begin = perf_counter()
            mujoco.mj_step(m, d)
            self.physics_time += perf_counter() - begin
            if d.ncon:
                self.inspection.contacts()
        if bundle is not None:
            d.ctrl[pos], d.ctrl[pos + 1], d.ctrl[pos + 2] = x1, v1, 0.0
        self.inspection.tick()
        for unit in self.stock.clear_outfeed():
            self.inspection.measured(self.stock.bodies_of(unit))
            self.stock.recycle(unit)

    def delivered(self) -> int:
        """Products that have left the outfeed."""
        return len(self.stock.left)


def load(model: Model) -> mujoco.MjModel:
    """The engine's model of what `write_model` writes."""
    xml = model.xml
    files: Mapping[str, bytes] = {f"meshes/{name}": content for name, content in model.files.items()}
    try:
        return mujoco.MjModel.from_xml_string(xml, dict(files))
    except ValueError as error:
        raise InputError(_explained(model, str(error))) from error


def _explained(model: Model, words: str) -> Diagnostic:
    """The engine's error, at the line of the part it speaks of where it names one."""
    for solid in model.layout.product.solids.values():
        mesh = f"mesh/{solid.mesh.name}" if solid.mesh else ""
        if f"part/{solid.label}#" in words or (mesh and mesh in words):
            position = model.factory.pag[solid.label].position
            return Diagnostic("BadMesh", words.strip(), position, "repair the mesh of this part")
    return Diagnostic("Engine", words.strip(), None, "please report this as a bug of factory")


__all__ = ["BITS", "MujocoWorld", "load"]
