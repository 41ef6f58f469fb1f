"""Whether the engine's model is that of the factory: solid things collide, bodies have the mass and
shape of their parts, nothing in the engine is switched off, and nothing differs from what was
compiled and rightly written since. A run of another model proves nothing.

What is expected of solids, masses and shapes comes from the layout's parts and from the holdings,
not from the written model.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import chain

import numpy as np

from factory.engine.mjcf import names
from factory.engine.mjcf.driving import GRAVITY
from factory.engine.mjcf.feeders import SLIDER_MASS
from factory.engine.mjcf.masks import masks_of
from factory.engine.mjcf.model import Model
from factory.engine.mjcf.outfeed import SHUTTER_MASS, TRAY_MASS
from factory.engine.simulation.mujoco.contacts import ContactMasks, of_one_robot
from factory.engine.simulation.mujoco.fusing import angles, rotations
from factory.engine.simulation.mujoco.model_arrays import ModelArrays
from factory.engine.simulation.mujoco.probing import untouched
from factory.floor.layout.feeding import housed_outlets
from factory.floor.layout.hands.limbs import limbs
from factory.support.arrays import Array, Index
from factory.support.engine import mujoco
from factory.support.errors import Diagnostic

NAMED = 3
"""So many are named of those that share a fault."""

STATION = 1
"""The bit of masks by which robots and stations collide with everything."""

STANDS = {"feeder", "outfeed", "bin", "ground"}
"""What stands, by the first word of its geoms' names; all of it is solid, but rods are not."""

HOUSING = ("post", "lid", "end-1", "end1", "wall-1", "wall1")
"""What a feeder's housing has."""

ROD = "/rod"
"""What the names of geoms end with that slide in lids, which have no holes for them."""

WEIGHTS = {"slider": SLIDER_MASS, "tray": TRAY_MASS, "shutter": SHUTTER_MASS}
"""What weighs how much of stations, by the last word of its name, with what is on it [kg]."""

HEAVIER = 1e-6
"""Masses are the same to this share."""

SHIFTED, TILTED = 1e-6, 1e-5
"""A geom is no further from its place in its part [m], and turned by no more [rad], than rounding
takes."""

HARMLESS = int(mujoco.mjtDisableBit.mjDSBL_ISLAND) | int(mujoco.mjtDisableBit.mjDSBL_WARMSTART)
"""What may be switched off: how the engine solves, not what."""


class Soundness:
    """Compares an engine's model with the factory's, whose parts have `bodies` by label and are in
    the hands that `grips` gives: welds, each with the code of its holder. `mass` (nbody,): what
    bodies weigh [kg], nan where nothing is asked for; `askew`: bodies that lie askew in a feeder,
    which press on nothing; `found`: all that was wrong when something first was."""

    def __init__(
        self,
        arrays: ModelArrays,
        d: mujoco.MjData,
        model: Model,
        masks: ContactMasks,
        bodies: Mapping[str, Index],
        grips: Callable[[], Iterable[tuple[int, int]]],
    ) -> None:
        self.arrays, self._clock, m = arrays, float(d.time), arrays.m
        self._d, self._model, self._of, self._grips = d, model, bodies, grips
        self.masks, self.askew, self.found = masks, set[int](), tuple[Diagnostic, ...]()
        self._name = [m.geom(geom).name for geom in range(m.ngeom)]
        called = [m.body(body).name for body in range(m.nbody)]
        robots = {names.carriage(r.name): r.body.mass for r in model.layout.factory.robots}
        weights = (robots.get(n, WEIGHTS.get(n.rpartition("/")[2], np.nan)) for n in called)
        self.mass = np.array([*weights])
        for label, ids in bodies.items():
            self.mass[ids] = model.carried.mass[label]
        self._shape: Array = np.empty(0)

    @property
    def _m(self) -> mujoco.MjModel:
        return self.arrays.m

    def weigh(self, bodies: Iterable[int], factor: float) -> None:
        """Expect bodies to weigh `factor` times as much, as a disturbance has set."""
        self.mass[[*bodies]] *= factor

    def look(self) -> None:
        """Check everything, unless a fault was found before."""
        if self.found:
            return
        wrong = *self._options(), *self._loose(), *self._heavy(), *self._misshapen()
        codes = {fault.code for fault in wrong}
        changed = [*self.arrays.first, *self.arrays.changes()]
        by_code: dict[str, list[str]] = {}
        for change in changed:
            if change.code not in codes:
                by_code.setdefault(change.code, []).append(change.message)
        others = (_each(code, "{}", words) for code, words in by_code.items())
        self.found = (*wrong, *chain.from_iterable(others))

    def watch(self, steps: int) -> None:
        """After some timesteps of the engine, check its clock, that nothing but the run has changed
        options or masks and, from time to time, anything else of its model."""
        if self.found:
            return
        now, step = float(self._d.time), self._model.settings.step
        self._clock += steps * step
        if abs(now - self._clock) > step / 2 and not self._d.warning.number.any():
            words = f"the engine's clock shows {now:.3f} s, {self._clock:.3f} s after its steps"
            self.found = (Diagnostic("Options", words),)
        elif not self.arrays.same(now):
            self.look()

    def probe(self) -> None:
        """Put parts into everything that is solid, and check that the engine finds the contacts."""
        if self.found:
            return
        try:
            geoms = untouched(self._m, self._stations(), self.masks.solid)
        except mujoco.FatalError as error:
            words = f"the engine cannot look for contacts: {str(error).splitlines()[0]}"
            self.found = (Diagnostic("NotSolid", words),)
            return
        names = (self._name[geom] for geom in geoms)
        self.found = tuple(_each("NotSolid", "nothing can touch {}", names))

    def _options(self) -> Iterator[Diagnostic]:
        """Engine options that differ from a factory's."""
        option = self._m.opt
        for name, bit in mujoco.mjtDisableBit.__members__.items():
            if int(bit) & option.disableflags & ~HARMLESS:
                word = name.removeprefix("mjDSBL_").lower()
                yield Diagnostic("Options", f"the engine's '{word}' is switched off")
        if not np.array_equal(option.gravity, (0.0, 0.0, -GRAVITY)):
            yield Diagnostic("Options", f"gravity is {option.gravity.tolist()} m/s²")
        if option.timestep != self._model.settings.step:
            yield Diagnostic("Options", f"the engine's timestep is {option.timestep:g} s")
        floating = np.flatnonzero(self._m.body_gravcomp).tolist()
        yield from _each("Options", "gravity acts less on {}", map(self._body, floating))

    def _loose(self) -> Iterator[Diagnostic]:
        """Geoms that should collide and do not."""
        m, layout = self._m, self._model.layout
        stations = self._stations()
        solid = (m.geom_contype[stations] > 0) & (m.geom_conaffinity[stations] & STATION > 0)
        soft = (m.geom_margin < 0) & ~np.isin(m.geom_bodyid, [*self.askew])
        loose = [self._name[geom] for geom in [*stations[~solid], *np.flatnonzero(soft)]]
        robots = [robot for robot in layout.factory.robots if layout.hands]
        limbed = {f"{r.name}/{limb.name}" for r in robots for limb in limbs(layout, r.index)}
        wanted = {"ground", names.OUTFEED_TRAY, names.SHUTTER} | limbed
        wanted |= {
            f"{names.feeder(outlet.label)}/{kind}"
            for outlet in housed_outlets(layout)
            for kind in HOUSING
            if kind != "lid" or not outlet.feeder.rises
        }
        sliders = [n for n in map(self._body, range(m.nbody)) if n.endswith("/slider")]
        wanted |= {names.pad(n.removeprefix("feeder/").removesuffix("/slider")) for n in sliders}
        loose += sorted(wanted.difference(self._name[geom] for geom in stations.tolist()))
        yield from _each("NotSolid", "{} is not solid", [*loose, *self._unmasked()])
        yield from _each("NotSolid", "{} do not collide", self._left_out())

    def _stations(self) -> Index:
        """The geoms of robots and stations, which collide with everything."""
        m, bodies = self._m, range(self._m.nbody)
        robots = np.array([names.kind(self._body(body)) == "robot" for body in bodies])
        stands = [names.kind(n) in STANDS and not n.endswith(ROD) for n in self._name]
        return np.flatnonzero(robots[m.geom_bodyid] & (m.geom_group == 0) | stands)

    def _unmasked(self) -> Iterator[str]:
        """Geoms of held parts whose masks are not those of their holder's payloads."""
        m, held = self._m, dict[int, list[tuple[int, int]]]()
        for weld, code in self._grips():
            if self._d.eq_active[weld]:
                held.setdefault(int(m.eq_obj2id[weld]), []).append(masks_of(code))
        for body, masks in held.items():
            geoms = self.masks.solid[body]
            actual = np.stack([m.geom_contype[geoms], m.geom_conaffinity[geoms]], axis=1)
            right = (actual[:, None] == masks).all(axis=2).any(axis=1)
            yield from (self._name[geom] for geom in geoms[~right].tolist())

    def _left_out(self) -> Iterator[str]:
        """Pairs of bodies that are excluded from contact and should not be."""
        apart = {frozenset(pair) for pair in self._model.excluded}
        listed = self._m.exclude_signature.view(np.uint32)
        for signature in listed[listed != np.iinfo(np.uint32).max].tolist():
            pair = [self._body(signature >> 16), self._body(signature & 0xFFFF)]
            if of_one_robot(self._m, signature):
                continue
            if frozenset(map(names.part_of, pair)) not in apart:
                yield " and ".join(pair)

    def _heavy(self) -> Iterator[Diagnostic]:
        """Bodies of a wrong mass."""
        mass, wanted, up = self._m.body_mass.copy(), self.mass, self._m.body_parentid
        for body in range(self._m.nbody - 1, 0, -1):
            mass[up[body]] += mass[body]
        wrong = np.flatnonzero(np.abs(mass - wanted) > HEAVIER * wanted).tolist()
        words = (f"{self._body(b)} weighs {mass[b]:.4g} kg, not {wanted[b]:.4g} kg" for b in wrong)
        yield from _each("Mass", "{}", words)

    def _misshapen(self) -> Iterator[Diagnostic]:
        """Parts whose geoms differ in place or size from the product."""
        m, wrong = self._m, list[str]()
        shape = np.hstack([m.geom_pos, m.geom_quat, m.geom_size])
        if np.array_equal(shape, self._shape):
            return
        for label, ids in self._of.items():
            solid = self.masks.solid
            first, *others = [solid[body] for body in ids.tolist()]
            place, turn, size = self._nominal(label, int(ids[0]), first)
            for geoms in (first, *others):
                off = np.linalg.norm(self._m.geom_pos[geoms] - place, axis=1) > SHIFTED
                tilt = angles(turn.transpose(0, 2, 1) @ rotations(self._m.geom_quat[geoms]))
                grown = np.abs(self._m.geom_size[geoms] - size).max(axis=1) > SHIFTED
                wrong += [self._name[g] for g in geoms[off | (tilt > TILTED) | grown].tolist()]
        yield from _each("Shape", "{} is not where its part is, or not as large", wrong)
        if not wrong:
            self._shape = shape

    def _nominal(self, label: str, body: int, geoms: Index) -> tuple[Array, Array, Array]:
        """Positions (n, 3), rotations (n, 3, 3) and sizes (n, 3) of the geoms of a body; nan for
        meshes."""
        m, solids, bodies = self._m, self._model.layout.product.solids, self._model.carried
        place, turn = np.zeros((len(geoms), 3)), np.zeros((len(geoms), 3, 3))
        size = np.full((len(geoms), 3), np.nan)
        for row, geom in enumerate(geoms.tolist()):
            inside = self._name[geom].removeprefix(f"{self._body(body)}/").partition("/")[0]
            solid = solids[inside if label in bodies.wholes else label]
            turn[row] = rotations(solid.quaternion[None])[0]
            place[row] = solid.position - bodies.centre[label]
            if solid.mesh is None:
                receded = m.geom_user[geom, 0] if m.nuser_geom else 0.0
                size[row, : len(solid.size)] = np.array(solid.size) - receded
            else:  # the engine puts a mesh's origin into its centre of mass
                mesh = int(m.geom_dataid[geom])
                place[row] += turn[row] @ m.mesh_pos[mesh]
                turn[row] = turn[row] @ rotations(m.mesh_quat[mesh][None])[0]
        return place, turn, size

    def _body(self, body: int) -> str:
        return str(self._m.body(body).name)


def _each(code: str, words: str, wrong: Iterable[str]) -> Iterator[Diagnostic]:
    """A fault for each of the first names, and the number of the others."""
    names = list(dict.fromkeys(wrong))
    yield from (Diagnostic(code, words.format(name)) for name in names[:NAMED])
    if len(names) > NAMED:
        yield Diagnostic(code, f"and {len(names) - NAMED} more")
