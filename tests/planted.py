"""Faults to be planted in a factory: what each does, and by which codes a run fails that has it.

One table (`PLANTS`): faults of the engine's model, of the bodies while it runs, of the product as
it is drawn, of the log. Benign ones change what a factory is made to bear, and fail no run."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

import numpy as np

from factory.apps.deviations.interference import Interference
from factory.apps.log import Log, read_log
from factory.apps.log.reader import digest_of
from factory.apps.log.writer import LogWriter
from factory.apps.monitor.record import recorded_subject, verdict_on, watch_log
from factory.apps.resume.remade import forged, model_faults
from factory.apps.runs.watched import watched
from factory.engine.mjcf import names
from factory.engine.record.verdict import RunVerdict
from factory.engine.simulation.mujoco import world as mujoco_world
from factory.engine.simulation.mujoco.parts import Parts
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
from factory.support.engine import mujoco
from factory.support.errors import InputError
from factory.support.settings import Settings
from factory.theory.plant.operation import Operation
from tests.examples import with_hands
from tests.pag_texts import laid_out
from tests.paths import ROOT

Acts = Callable[[Any, Any], None]
"""Acts on an engine's model and data."""

OFF = mujoco.mjtDisableBit

MASKS = ("body_contype", "body_conaffinity", "geom_contype", "geom_conaffinity")
OPTIONS = ("timestep", "density", "gravity")
"""What is changed for a while."""


@dataclass(frozen=True)
class Plant:
    """A fault, of a `kind`: `xml` changes the model's text, `engine` the model before the run,
    `run` model and data once in it, `while` the model for 0.2 s, `switch` model and data where sub1
    is made and no weld is switched yet, `disturbance` declares a change, `mesh` changes the model
    of a product with meshes, `log` the log of an honest run; `product` is a PAG. A run with it
    fails by all of these `codes`; of none it succeeds."""

    name: str
    kind: str
    act: Any
    codes: tuple[str, ...] = ()

    def __str__(self) -> str:
        return self.name

    def verdict(self) -> RunVerdict:
        """The verdict on a run that has it."""
        return RUNNERS[self.kind](self.act)


@cache
def paper() -> Layout:
    """The paper's example, with hands."""
    return with_hands("paper")


def _run(layout: Layout, **more: Any) -> RunVerdict:
    return watched(Simulation(layout, RunRequest(shown=False, **more))).verdict


def _of_settings(settings: Settings) -> RunVerdict:
    """A run with other settings."""
    return _run(paper(), units=2, settings=settings)


def _of_mesh(act: Callable[[Any], None]) -> RunVerdict:
    """The same as `_of_engine`, of a product with meshes."""
    return _of_engine(act, with_hands("peg"))


def _of_disturbance(act: Callable[[Interference], None]) -> RunVerdict:
    """A run in which something is other than the factory knows, and declared."""
    simulation = Simulation(paper(), RunRequest(units=2, shown=False))
    act(Interference(simulation.physical))
    return watched(simulation).verdict


def _of_while(act: Callable[[Any], None]) -> RunVerdict:
    """A run in which the model is changed at 1 s, and is as it was at 1.2 s."""
    simulation = Simulation(paper(), RunRequest(units=2, shown=False))
    world, before = simulation.physical, dict[str, Any]()

    def some_time() -> None:
        m = world.m
        if world.time >= 1.0 and not before:
            before.update({name: getattr(m, name).copy() for name in MASKS})
            before.update({name: np.array(getattr(m.opt, name)) for name in OPTIONS})
            act(m)
        elif world.time >= 1.2 and not world.hooks.ticks:
            for name in MASKS:
                getattr(m, name)[:] = before[name]
            m.opt.timestep, m.opt.density = before["timestep"], before["density"]
            m.opt.gravity[:] = before["gravity"]
            world.hooks.ticks.append(lambda: None)  # once

    world.hooks.before_step.append(some_time)
    return watched(simulation, max_time=12.0).verdict


def _of_engine(act: Callable[[Any], None], layout: Layout | None = None) -> RunVerdict:
    """A run in a model that was changed after it had been compiled."""
    load = mujoco_world.load

    def changed(model: Any) -> Any:
        m = load(model)
        act(m)
        return m

    with patch.object(mujoco_world, "load", changed):
        return _run(layout or paper(), units=2)


def _of_xml(change: Callable[[str], str]) -> RunVerdict:
    """A run in a model whose text was changed before it was compiled."""
    load = mujoco_world.load

    def changed(model: Any) -> Any:
        xml = change(model.xml)
        assert xml != model.xml
        return load(replace(model, xml=xml))

    with patch.object(mujoco_world, "load", changed):
        try:
            return _run(paper(), units=2)
        except InputError as error:  # what is lacking is said before the run
            return RunVerdict(error.diagnostics[0])


def _of_run(act: Acts) -> RunVerdict:
    """A run in which something is changed once, at 1 s."""
    simulation = Simulation(paper(), RunRequest(units=2, shown=False))
    world, done = simulation.physical, list[bool]()

    def once() -> None:
        if world.time >= 1.0 and not done:
            done.append(True)
            act(world.m, world.d)

    world.hooks.before_step.append(once)
    return watched(simulation, max_time=12.0).verdict


@contextmanager
def before_the_switch(label: str, act: Acts) -> Iterator[None]:
    """Act once, where an operation has ended and no weld is switched yet."""
    hand_over, done = Parts.hand_over, list[bool]()

    def acted(self: Parts, ended: Sequence[tuple[Operation, int]]) -> None:
        if not done and any(operation.label == label for operation, _ in ended):
            done.append(True)
            act(self.welds._m, self.welds._d)
        hand_over(self, ended)

    with patch.object(Parts, "hand_over", acted):
        yield


def _of_switch(act: Acts) -> RunVerdict:
    with before_the_switch("sub1", act):
        return watched(Simulation(paper(), RunRequest(shown=False)), max_time=12.0).verdict


def _of_product(text: str) -> RunVerdict:
    return _run(laid_out(text))


def _of_log(change: Callable[[Log], Log]) -> RunVerdict:
    changed = change(honest_log())
    faults, _ = model_faults(changed, ROOT / "examples")
    report = None if forged(faults) else watch_log(changed)[0]
    return verdict_on(changed, recorded_subject(changed.header).factory, report, faults)


@cache
def honest_log() -> Log:
    """The log of a run of the paper's example."""
    return _logged(paper(), lambda m, d: None)


@cache
def hit_log() -> Log:
    """The log of a run in which a part was put into a carriage."""
    with before_the_switch("sub1", into("part/part1#1", "r2/carriage")):
        return _logged(paper(), lambda m, d: None)


def _logged(layout: Layout, act: Acts) -> Log:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "log"
        simulation = Simulation(layout, RunRequest(units=2, seed=2, jitter=0.3))
        with LogWriter(path, simulation) as writer:
            simulation.run([writer.observe], 20.0)
        return read_log(path)


RUNNERS: dict[str, Callable[[Any], RunVerdict]] = {
    "xml": _of_xml,
    "engine": _of_engine,
    "run": _of_run,
    "while": _of_while,
    "disturbance": _of_disturbance,
    "mesh": _of_mesh,
    "switch": _of_switch,
    "product": _of_product,
    "log": _of_log,
    "settings": _of_settings,
}


def both(act: Callable[[Any], None]) -> Acts:
    """The same while a run goes on."""
    return lambda m, d: act(m)


def hollow(*words: str) -> Callable[[Any], None]:
    """Geoms whose names end so, or all, collide with nothing."""

    def act(m: Any) -> None:
        for geom in range(m.ngeom):
            if not words or m.geom(geom).name.endswith(words):
                m.geom_contype[geom] = m.geom_conaffinity[geom] = 0

    return act


def text(pattern: str, by: str) -> Callable[[str], str]:
    """The model's text with another in the place of a pattern."""
    return lambda xml: re.sub(pattern, by, xml)


def off(bit: Any) -> Callable[[Any], None]:
    """Something of the engine is switched off."""

    def act(m: Any) -> None:
        m.opt.disableflags |= int(bit)

    return act


def ghostly(m: Any) -> None:
    """Contact is found, and has no force."""
    m.geom_gap[:], m.geom_margin[:] = 1.0, -1.0


def weightless(m: Any) -> None:
    """There is no gravity."""
    m.opt.gravity[:] = 0.0


def heavier(body: str, by: float = 2.0) -> Callable[[Any], None]:
    """A body weighs so many times as much."""

    def act(m: Any) -> None:
        m.body_mass[m.body(body).id] *= by
        m.body_inertia[m.body(body).id] *= by
        mujoco.mj_setConst(m, mujoco.MjData(m))

    return act


def floating(body: str) -> Callable[[Any], None]:
    """Gravity does not act on a body."""

    def act(m: Any) -> None:
        m.body_gravcomp[m.body(body).id] = 1.0

    return act


def turn(degrees: float) -> np.ndarray:
    """The quaternion of a turn about the vertical."""
    half = np.radians(degrees) / 2
    return np.array([np.cos(half), 0, 0, np.sin(half)])


def misshapen(part: str, shift: float = 0.0, degrees: float = 0.0, size: float = 1.0) -> Any:
    """The geoms of a part are elsewhere in its body."""

    def act(m: Any) -> None:
        first = m.body_geomadr[m.body(part).id]
        for geom in range(first, first + m.body_geomnum[m.body(part).id]):
            m.geom_pos[geom, 0] += shift
            m.geom_size[geom] *= size
            mujoco.mju_mulQuat(m.geom_quat[geom], turn(degrees), m.geom_quat[geom].copy())

    return act


def pad(name: str, by: float) -> Callable[[Any], None]:
    """A pad is higher or lower in its hand."""

    def act(m: Any) -> None:
        m.geom_pos[m.geom(name).id, 2] += by

    return act


def reframed(weld: str, shift: float = 0.0, degrees: float = 0.0) -> Callable[[Any], None]:
    """A weld keeps what it holds elsewhere."""

    def act(m: Any) -> None:
        number = m.equality(weld).id
        m.eq_data[number, 3] += shift
        rotated = np.empty(4)
        mujoco.mju_mulQuat(rotated, turn(degrees), m.eq_data[number, 6:10])
        m.eq_data[number, 6:10] = rotated

    return act


def array(name: str, by: float, *only: str, plus: float = 0.0) -> Callable[[Any], None]:
    """An array of the model is so many times as large, and more; of these geoms, bodies or joints
    only, if any are named."""

    def act(m: Any) -> None:
        kind = {"geom": m.geom, "body": m.body, "jnt": m.joint}.get(name.partition("_")[0])
        rows = [kind(one).id for one in only] if kind and only else slice(None)
        changed = getattr(m, name)
        changed[rows] = (changed[rows] * by + plus).astype(changed.dtype)

    return act


def option(name: str, value: Any) -> Callable[[Any], None]:
    """An option of the engine is another."""

    def act(m: Any) -> None:
        setattr(m.opt, name, value)

    return act


def faster(m: Any) -> None:
    """The engine's steps are longer by a tenth."""
    m.opt.timestep *= 1.1


def later(m: Any, d: Any) -> None:
    """The engine's clock is put forward by a tick."""
    d.time += 0.01


def unmasked(m: Any) -> None:
    """No body can collide."""
    m.body_contype[:] = m.body_conaffinity[:] = 0


def welded(weld: str, on: bool) -> Acts:
    """A weld is switched, of itself."""

    def act(m: Any, d: Any) -> None:
        d.eq_active[m.equality(weld).id] = on

    return act


def moved(joint: str, by: float) -> Acts:
    """A robot jumps along its guidepath."""

    def act(m: Any, d: Any) -> None:
        d.qpos[m.jnt_qposadr[m.joint(joint).id]] += by

    return act


def displaced(part: str, by: float = 0.0, degrees: float = 0.0, axis: int = 0) -> Acts:
    """A part jumps along an axis, or turns."""

    def act(m: Any, d: Any) -> None:
        at = m.jnt_qposadr[m.body_jntadr[m.body(part).id]]
        d.qpos[at + axis] += by
        d.qpos[at + 3 : at + 7] = turn(degrees)

    return act


def into(part: str, body: str) -> Acts:
    """A part is put into something."""

    def act(m: Any, d: Any) -> None:
        at = m.jnt_qposadr[m.body_jntadr[m.body(part).id]]
        d.qpos[at : at + 3] = d.xpos[m.body(body).id]

    return act


def warns(m: Any, d: Any) -> None:
    """The engine warns."""
    d.warning[int(mujoco.mjtWarning.mjWARN_CNSTRFULL)].number += 1


def figures(**values: Any) -> Callable[[Log], Log]:
    """The log of a run in which something was hit says other figures."""

    def change(log: Log) -> Log:
        del log
        kept = hit_log()
        return replace(kept, figures={**(kept.figures or {}), **values})

    return change


def without_figures(log: Log) -> Log:
    """The log of a run in which something was hit has no figures."""
    return replace(hit_log(), figures=None)


def states(joint: str, by: float, row: int = 150, rows: int = 1) -> Callable[[Log], Log]:
    """A coordinate in some rows of a log is another."""

    def change(log: Log) -> Log:
        m = mujoco.MjModel.from_xml_string(
            log.xml, {f"meshes/{n}": f for n, f in log.files.items()}
        )
        qpos = np.array(log.qpos)
        qpos[row : row + rows, m.jnt_qposadr[m.joint(joint).id]] += by
        return replace(log, qpos=qpos)

    return change


def said(**values: Any) -> Callable[[Log], Log]:
    """The log of an honest run says other figures; it lacks those that are None."""

    def change(log: Log) -> Log:
        figures = {**(log.figures or {}), **values}
        return replace(log, figures={k: v for k, v in figures.items() if v is not None})

    return change


def lacking(name: str) -> Callable[[Log], Log]:
    """The log of an honest run lacks a figure."""
    return lambda log: replace(
        log, figures={k: v for k, v in (log.figures or {}).items() if k != name}
    )


def header(signed: bool = False, **values: Any) -> Callable[[Log], Log]:
    """The header of a log says something else; `signed`: the digest at the end of the log too."""

    def change(log: Log) -> Log:
        other = {**log.header, **values}
        figures = {**(log.figures or {}), **({"header": digest_of(other)} if signed else {})}
        return replace(log, header=other, figures=figures)

    return change


def crowd(log: Log) -> Log:
    """The model in a log has 20,000 spheres in one place."""
    balls = "<body><freejoint/>" + '<geom size="0.1"/>' * 20_000 + "</body>"
    return replace(log, xml=log.xml.replace("</worldbody>", f"{balls}</worldbody>", 1))


def swapped(log: Log) -> Log:
    """Two firings of different times change places."""
    fired, times = log.fired.copy(), log.fired_t
    one = next(k for k in range(8, len(fired)) if times[k + 1] - times[k] > 0.05)
    fired[[one, one + 1]] = fired[[one + 1, one]]
    return replace(log, fired=fired)


def model_text(pattern: str, by: str) -> Callable[[Log], Log]:
    """The model's text in a log has another in the place of a pattern."""

    def change(log: Log) -> Log:
        changed = re.sub(pattern, by, log.xml, count=1)
        assert changed != log.xml
        return replace(log, xml=changed)

    return change


def loosened(log: Log) -> Log:
    """The log no longer has the constraint by which something is held, in some rows."""
    values, grips = log.active.values.copy(), 0
    m = mujoco.MjModel.from_xml_string(log.xml, {f"meshes/{n}": f for n, f in log.files.items()})
    for row in values:
        if m.equality(int(row[0])).name.startswith("grip") and grips < 1:
            row[2] = next(
                b for b in range(m.nbody) if names.kind(m.body(b).name) == "part" and b != row[2]
            )
            grips += 1
    return replace(log, active=replace(log.active, values=values))


OVERLAP = """root = r; r = mate ( a, b ); %s
a = atomic ( box = (0.04, 0.04, 0.04), pos = (0, 0, 0.02) );
b = atomic ( box = (0.04, 0.04, %s), pos = (0, %s, 0.02) )"""
"""Two boxes side by side, that overlap where they are less than 40 mm apart."""

CLOSED = """root = all; all = mate ( shell, core ); shell = mate ( front, back, roof, floor ); %s
core = atomic ( box = ( 0.05, 0.05, 0.05 ) );
front = atomic ( box = ( 0.1, 0.02, 0.1 ), pos = ( 0, -0.06, 0 ) );
back = atomic ( box = ( 0.1, 0.02, 0.1 ), pos = ( 0, 0.06, 0 ) );
roof = atomic ( box = ( 0.1, 0.1, 0.02 ), pos = ( 0, 0, 0.06 ) );
floor = atomic ( box = ( 0.1, 0.1, 0.02 ), pos = ( 0, 0, -0.06 ) )"""
"""A box that is closed before its core comes in, 35 mm deep through a wall."""


TABLE: dict[str, dict[str, tuple[str, Any]]] = {
    "engine": {
        "nothing is solid": ("NotSolid", hollow()),
        "a hand is not solid": ("NotSolid", hollow("r5/finger", "r5/pad", "r5/column")),
        "nothing presses on anything": ("NotSolid", ghostly),
        "a pad is not solid": ("NotSolid", hollow("r3/pad")),
        "a carriage is not solid": ("NotSolid", hollow("r2/carriage")),
        "a magazine is not solid": ("NotSolid", hollow("feeder/part1/post")),
        "a magazine's lid is not solid": ("NotSolid", hollow("feeder/part2/lid")),
        "a feeder's pad is not solid": ("NotSolid", hollow("feeder/part2/pad")),
        "the tray is not solid": ("NotSolid", hollow("outfeed/tray")),
        "the shutter is not solid": ("NotSolid", hollow("outfeed/shutter")),
        "the floor is not solid": ("NotSolid", hollow("ground")),
        "contacts are switched off": ("Options", off(OFF.mjDSBL_CONTACT)),
        "constraints are switched off": ("Options", off(OFF.mjDSBL_CONSTRAINT)),
        "welds are switched off": ("Options", off(OFF.mjDSBL_EQUALITY)),
        "limits are switched off": ("Options", off(OFF.mjDSBL_LIMIT)),
        "gravity is switched off": ("Options", off(OFF.mjDSBL_GRAVITY)),
        "gravity is nothing": ("Options", weightless),
        "gravity does not act on a part": ("Options", floating("part/part1#1")),
        "a part weighs twice as much": ("Mass", heavier("part/part1#1")),
        "a part weighs half as much": ("Mass", heavier("part/part3#1", 0.5)),
        "a carriage weighs twice as much": ("Mass", heavier("r4/carriage")),
        "the tray weighs twice as much": ("Mass", heavier("outfeed/tray")),
        "a slider weighs twice as much": ("Mass", heavier("feeder/part1/slider")),
        "a part's shape is shifted by 0.2 mm": ("Shape", misshapen("part/part1#1", 2e-4)),
        "a part's shape is turned by 1°": ("Shape", misshapen("part/part1#1", 0, 1)),
        "a part's shape is turned by 0.2°": ("Shape", misshapen("part/part2#1", 0, 0.2)),
        "a part's shape is a tenth as large": ("Shape", misshapen("part/part1#1", size=0.1)),
        "a pad is 2 mm lower": ("GripGap", pad("r5/pad", -2e-3)),
        "a feeder's pad is 1 mm higher": ("Contact", pad("feeder/part1/pad", 1e-3)),
        "a grip holds 0.2 mm off": ("Frame", reframed("grip/r3/part2", 2e-4)),
        "a grip holds it turned by 1°": ("Frame", reframed("grip/r3/part2", 0, 1)),
        "a grip holds it turned by 0.2°": ("Frame", reframed("grip/r5/part1", 0, 0.2)),
        "the tray holds it turned by 1°": ("Frame", reframed("hold/part2", 0, 1)),
        "no body can collide": ("NotSolid", unmasked),
        "the boxes round geoms are nothing": ("NotSolid", array("geom_aabb", 0.0)),
        "the boxes of the broad phase are nothing": ("NotSolid", array("bvh_aabb", 0.0)),
        "the spheres round geoms are nothing": ("NotSolid", array("geom_rbound", 0.0)),
        "a carriage is half as large": ("Shape", array("geom_size", 0.5, "r2/carriage")),
        "a wall of a magazine is elsewhere": (
            "Shape",
            array("geom_pos", 1.0, "feeder/part1/wall1", plus=0.01),
        ),
        "drives are half as strong": ("Altered", array("actuator_forcerange", 0.5)),
        "setpoints have other bounds": ("Altered", array("actuator_ctrlrange", 1.0, plus=1.0)),
        "drives are stiffer by a tenth": ("Altered", array("actuator_biasprm", 1.1)),
        "there is air": ("Options", option("density", 1.2)),
        "the air is thick": ("Options", option("viscosity", 0.1)),
        "the wind blows": ("Options", option("wind", (1.0, 0.0, 0.0))),
        "the solver takes one step": ("Options", option("iterations", 1)),
        "the solver is content with less": ("Options", option("tolerance", 1e-2)),
        "contacts begin elsewhere": ("Options", option("o_margin", 0.01)),
        "the integrator is another": ("Options", option("integrator", 3)),
        "welds are softer": ("Altered", array("eq_solref", 2.0)),
        "a motor is heavier": ("Altered", array("dof_armature", 1.0, plus=0.5)),
        "joints have other ranges": ("Altered", array("jnt_range", 1.0, plus=0.01)),
        "guides are rougher": ("Altered", array("dof_frictionloss", 1.0, plus=0.1)),
        "parts are twice as rough": ("Altered", array("geom_friction", 2.0)),
        "a part is harder to turn": ("Mass", array("body_inertia", 2.0, "part/part1#1")),
    },
    "mesh": {"vertices are elsewhere": ("Shape", array("mesh_vert", 0.99))},
    "while": {
        "the clock is a tenth fast for 0.2 s": ("Options", faster),
        "there is no gravity for 0.2 s": ("Options", weightless),
        "nothing is solid for 0.2 s": ("NotSolid", hollow()),
        "no body can collide for 0.2 s": ("NotSolid", unmasked),
        "there is air for 0.2 s": ("Options", option("density", 1.2)),
    },
    "run": {
        "nothing is solid any more": ("NotSolid", both(hollow())),
        "a part is not solid any more": ("NotSolid", both(hollow("part/part1#1"))),
        "contacts are switched off in the run": ("Options", both(off(OFF.mjDSBL_CONTACT))),
        "gravity is nothing from 1 s on": ("Options", both(weightless)),
        "a grip shifts by 0.2 mm in the run": (
            "ProductError",
            both(reframed("grip/r1/part2", 2e-4)),
        ),
        "the tray's hold shifts by 0.2 mm in the run": (
            "ProductError",
            both(reframed("hold/part1", 2e-4)),
        ),
        "the tray's hold turns by 1° in the run": (
            "ProductTurn ProductError",
            both(reframed("hold/part1", 0, 1)),
        ),
        "the tray's hold turns by 0.2° in the run": (
            "ProductTurn",
            both(reframed("hold/part3", 0, 0.2)),
        ),
        "the clock is put forward": ("Options", later),
        "spheres round geoms are nothing from 1 s on": (
            "NotSolid",
            both(array("geom_rbound", 0.0)),
        ),
        "a weld more": ("TwoHolders", welded("grip/r1/part3", True)),
        "a weld less": ("Dropped", welded("grip/r3/part1", False)),
    },
    "xml": {
        "a finger is only shown": (
            "NotSolid",
            text(r'(name="r5/finger" )', r'\1group="1" contype="0" conaffinity="0" '),
        ),
        "a pad is missing": ("NotSolid", text(r'<geom name="r5/pad"[^>]*/>', "")),
        "a grip is missing": ("Engine", text(r'<weld name="grip/r3/part2"[^>]*/>', "")),
        "a tray's hold is missing": ("Engine", text(r'<weld name="hold/part1"[^>]*/>', "")),
        "a drive is missing": ("Engine", text(r'<pid name="r3/drive"[^>]*/>', "")),
        "the floor is missing": ("NotSolid", text(r'<geom name="ground"[^>]*/>', "")),
        "a magazine's lid is missing": (
            "NotSolid",
            text(r'<geom name="feeder/part1/lid"[^>]*/>', ""),
        ),
        "a magazine is only shown": (
            "NotSolid",
            text(r'(name="feeder/part1/wall1" class=)"station"', r'\1"shown"'),
        ),
        "robots are only shown": (
            "NotSolid",
            text(r'contype="1" conaffinity="1"', 'contype="0" conaffinity="0"'),
        ),
        "two robots are left out of contact": (
            "NotSolid",
            text(
                "<equality>",
                '<contact><exclude body1="r2/carriage" body2="r3/carriage"/></contact><equality>',
            ),
        ),
        "there is no gravity": ("Options", text("<option ", '<option gravity="0 0 0" ')),
        "the timestep is another": ("Options", text(r'timestep="[^"]*"', 'timestep="0.002"')),
        "a part is twice as heavy in the text": (
            "Mass",
            text(r'(?s)(name="part/part1#1".*?mass=")', r"\g<1>1"),
        ),
    },
    "switch": {
        "a carriage jumps by 5 mm": ("Early Missed", moved(names.slide("r3"), -5e-3)),
        "a carriage jumps by 0.6 mm": ("Early", moved(names.slide("r3"), -6e-4)),
        "a part jumps by 5 mm": ("Missed HandOffGap", displaced("part/part1#1", 5e-3)),
        "a part jumps by 0.6 mm": ("Missed", displaced("part/part1#1", 6e-4)),
        "a part turns by 1°": ("Missed HandOffTurn", displaced("part/part1#1", 0, 1)),
        "a part turns by 0.2°": ("Missed HandOffTurn", displaced("part/part1#1", 0, 0.2)),
        "a part is put into a carriage": ("Contact", into("part/part1#1", "r2/carriage")),
        "the engine warns": ("EngineWarning", warns),
    },
    "product": {
        "parts overlap by 0.3 mm": ("Overlap", OVERLAP % ("", "0.04", "0.0397")),
        "parts overlap by 2 mm": ("Overlap", OVERLAP % ("", "0.04", "0.038")),
        "a part is inside another": ("Overlap", OVERLAP % ("", "0.02", "0.001")),
        "parts overlap by more than is allowed": (
            "Overlap",
            OVERLAP % ("allow ( 0.0001 );", "0.04", "0.0397"),
        ),
    },
    "log": {
        "the log says 0 contacts": (
            "Record Contact",
            figures(unintended_contacts=0, contacts=[], contact_first_s=None),
        ),
        "the log says one contact of many": ("Record", figures(unintended_contacts=1)),
        "the log says no figures": ("Contact", without_figures),
        "the log says no gap": ("Record", figures(handoff_gap_max_mm=0.0)),
        "the log says no distance of pads": ("Record", figures(grip_gap_max_mm=0.0)),
        "the log's contact is none, by a word": (
            "Record Contact",
            figures(unintended_contacts=None),
        ),
        "two firings are swapped in the log": ("Record", swapped),
        "a firing is missing in the log": (
            "Record",
            lambda log: replace(log, fired=log.fired[:-1], fired_t=log.fired_t[:-1]),
        ),
        "firings are later in the log": (
            "Record",
            lambda log: replace(log, fired_t=log.fired_t + 0.05),
        ),
        "a robot is 1 mm off in a row of the log": ("Record", states("r3/slide", 1e-3)),
        "a robot is 1 mm off from then on in the log": (
            "Record",
            states("r4/slide", 1e-3, rows=9999),
        ),
        "a grip is on another part in the log": ("TwoHolders", loosened),
        "a pad is only shown in the log's model": (
            "Record",
            model_text(r'(<geom name="r5/pad" )', r'\1contype="0" conaffinity="0" '),
        ),
        "a part is lighter in the log's model": (
            "Record",
            model_text(r'(?s)(name="part/part1#1".*?mass=")', r"\g<1>0"),
        ),
        "the log says a larger gap": ("Record", said(handoff_gap_max_mm=0.9)),
        "the log says a larger error": ("Record", said(product_error_max_mm=0.09)),
        "the log says a turn": ("Record", said(product_angle_max_deg=0.09)),
        "the log says contacts": ("Record", said(unintended_contacts=3)),
        "the log says a contact of what is apart": (
            "Record",
            said(
                unintended_contacts=1, contacts=["r2/carriage - r6/carriage"], contact_first_s=1.0
            ),
        ),
        "the log says 99 contacts of many": ("Record", figures(unintended_contacts=99)),
        "the log lacks the gap": ("Record", lacking("handoff_gap_max_mm")),
        "the log lacks its contacts": ("Record", lacking("unintended_contacts")),
        "the log lacks its engine's warnings": ("Record", lacking("engine_warnings")),
        "the log says what it leaves open": ("Record", said(reservations=["no hand holds x"])),
        "the log makes up an overlap": ("Record", said(faults=[["Overlap", "a and b overlap"]])),
        "the log is of another seed": ("Record", header(seed=9)),
        "the log is of another seed, and signed": ("Record", header(True, seed=9)),
        "the log is of another jitter, and signed": ("Record", header(True, jitter=0.1)),
        "the log is of other versions": (
            "NotJudged",
            header(versions={"klavins-factory": "0.0.1", "mujoco": "3.0", "numpy": "2.0"}),
        ),
        "the log's model is crowded": ("Record", crowd),
        "a robot is paler in the log's model": (
            "Record",
            model_text(r'(class="shown" type="sphere" pos=")-1', r"\g<1>-2"),
        ),
    },
}
"""By kind and name the codes by which a run fails, and what is done."""

PLANTS = tuple(
    Plant(name, kind, act, tuple(codes.split()))
    for kind, rows in TABLE.items()
    for name, (codes, act) in rows.items()
)
"""What must be found."""


BENIGN = (
    Plant("nothing", "run", lambda m, d: None),
    Plant("rails have more dry friction", "disturbance", lambda by: by.rub(np.arange(6), 0.6)),
    Plant("parts weigh more", "disturbance", lambda by: by.weigh([by._m.nbody - 1], 1.1)),
    Plant("drives are weaker by a tenth", "disturbance", lambda by: by.weaken(np.arange(6), 0.9)),
    Plant("parts overlap by 0.01 mm", "product", OVERLAP % ("", "0.04", "0.03999")),
    Plant(
        "parts overlap by what is allowed",
        "product",
        OVERLAP % ("allow ( a, b, 0.0003 );", "0.04", "0.0397"),
    ),
    Plant(
        "parts pass through each other by what is allowed",
        "product",
        CLOSED % "allow ( core, front, 0.036 );",
    ),
    Plant("goal balls are ten times as large", "settings", Settings(eps=2e-3)),
    Plant("the log is as it was", "log", lambda log: log),
)
"""What must not fail a run."""
