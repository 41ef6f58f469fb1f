"""Parts joined for good as one rigid body: momentum, product error, times; the monitor sees it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import factory
from factory.apps.deviations import Deviation, deviate
from factory.apps.monitor import beside
from factory.apps.runs.options import FUSE_FROM, fusing_pays
from factory.engine.mjcf.masks import robot_code
from factory.engine.simulation.modelling import physical_model
from factory.engine.simulation.mujoco.fusing import SETTLING, Fusion, rotations
from factory.engine.simulation.mujoco.holdings import Holdings
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.geometry.fused_bodies import bodies_of, fused_copies
from factory.floor.geometry.product import product_geometry
from factory.support.engine import mujoco
from factory.support.settings import MOST, Settings
from tests.command_line import Terminal
from tests.pag_texts import laid_out
from tests.paths import PAPER
from tests.simulation_values import layout_of, ready


def free_bodies(rng: np.random.Generator, count: int) -> tuple[mujoco.MjModel, mujoco.MjData, int]:
    """`count` free boxes somewhere, turned in their bodies' frames, and the body that they are
    together."""
    mass, half = rng.uniform(0.1, 3, count), rng.uniform(0.02, 0.2, (count, 3))
    turns = [" ".join(map(repr, turn.tolist())) for turn in rng.normal(size=(count, 4))]
    place = rng.uniform(-0.5, 0.5, (count, 3))
    centre = mass @ place / mass.sum()
    boxes = [
        f'<geom type="box" size="{h[0]} {h[1]} {h[2]}" mass="{m}" quat="{t}" pos="{{}} {{}} {{}}"/>'
        for h, m, t in zip(half, mass, turns, strict=True)
    ]
    parts = "".join(
        f'<body pos="{p[0]} {p[1]} {p[2]}"><freejoint/>{box.format(0, 0, 0)}</body>'
        for p, box in zip(place, boxes, strict=True)
    )
    inside = "".join(box.format(*(p - centre)) for p, box in zip(place, boxes, strict=True))
    whole = f'<body pos="9 9 9"><freejoint/>{inside}</body>'
    m = mujoco.MjModel.from_xml_string(
        f"<mujoco><option gravity='0 0 0'/><worldbody>{parts}{whole}</worldbody></mujoco>"
    )
    return m, mujoco.MjData(m), count + 1


def momentum(m: mujoco.MjModel, d: mujoco.MjData, bodies: list[int]) -> np.ndarray:
    """Linear and angular momentum about the origin (6,) of some bodies, by the engine's account."""
    mujoco.mj_forward(m, d)
    mujoco.mj_subtreeVel(m, d)
    mass, place = m.body_mass[bodies, None], d.xipos[bodies]
    linear = mass * d.subtree_linvel[bodies]
    return np.append(
        linear.sum(axis=0), (np.cross(place, linear) + d.subtree_angmom[bodies]).sum(axis=0)
    )


def nowhere(m: mujoco.MjModel, d: mujoco.MjData) -> Fusion:
    """Of bodies that belong nowhere."""
    return Fusion(m, d, np.zeros((m.nbody, 3)), np.zeros(m.nbody))


@settings(max_examples=25, deadline=None)
@given(st.integers(2, 5), st.integers(0, 2**32 - 1))
def test_momentum_goes_over_to_the_one_body(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    m, d, whole = free_bodies(rng, count)
    d.qvel[: 6 * count] = rng.normal(0, 1, 6 * count)
    bodies = list(range(1, whole))
    before = momentum(m, d, bodies)
    nowhere(m, d).fuse(bodies, whole)
    after = momentum(m, d, [whole])
    assert np.allclose(after, before, atol=1e-9)
    assert np.allclose(d.xipos[whole], m.body_mass[bodies] @ d.xipos[bodies] / m.body_mass[whole])


def test_a_rigid_motion_goes_over_unchanged() -> None:
    m, d, whole = free_bodies(np.random.default_rng(5), 3)
    turning = np.array([0.3, -0.2, 0.5])
    for body in range(1, whole):
        v = 6 * (body - 1)
        d.qvel[v : v + 3] = np.arange(3) + np.cross(turning, d.qpos[7 * (body - 1) :][:3])
        d.qvel[v + 3 : v + 6] = turning
    mujoco.mj_forward(m, d)
    before = d.energy.copy()
    nowhere(m, d).fuse([1, 2, 3], whole)
    assert np.allclose(d.qvel[-3:], turning)
    assert np.array_equal(before, d.energy)


def test_what_has_become_heavier_keeps_its_momentum() -> None:
    simulation = Simulation(layout_of("truck"), RunRequest(units=1, fuse=True))
    world, parts = simulation.physical, simulation.physical.parts
    m, d, of_label, fed = world.m, world.d, parts.holdings.body, [*parts.feeders.welds]
    deviate(simulation, *(Deviation("mass", label=label, factor=2.0) for label in fed[:2]))
    whole = int(next(of_label[label][0] for label in of_label if label not in fed))
    bodies = [int(of_label[label][0]) for label in fed[:2]]
    for body in bodies:
        at = m.body_dofadr[body]
        d.qvel[at : at + 6] = np.random.default_rng(body).normal(0, 1, 6)
    m.body_mass[whole] = m.body_mass[bodies].sum()
    mujoco.mj_setConst(m, mujoco.MjData(m))
    before = momentum(m, d, bodies)
    parts.joining.fusion.fuse(bodies, whole)
    assert np.allclose(momentum(m, d, [whole]), before, atol=1e-9)


def test_the_one_body_is_shown_where_the_others_were() -> None:
    """Until the engine's next step, and turned as the heaviest from then on."""
    m, d, whole = free_bodies(np.random.default_rng(4), 3)
    m.body_mass[1:4] = 1.0, 3.0, 2.0
    d.qpos[: 7 * 3] += np.random.default_rng(7).normal(0, 0.2, 7 * 3)
    mujoco.mj_forward(m, d)
    d.xpos[1:4] += 0.1
    nowhere(m, d).fuse([1, 2, 3], whole)
    assert np.allclose(d.xpos[whole], m.body_mass[1:4] @ d.xpos[1:4] / 6)
    assert np.array_equal(d.xmat[whole], d.xmat[2])
    assert np.array_equal(d.xquat[whole], d.xquat[2])
    assert np.array_equal(d.qpos[7 * 3 + 3 :], d.qpos[7 + 3 : 14])


def test_misfit_sees_a_shift_and_a_turn() -> None:
    m, d, _ = free_bodies(np.random.default_rng(1), 2)
    mujoco.mj_forward(m, d)
    fusion, both = Fusion(m, d, d.xpos.copy(), np.full(m.nbody, 0.1)), [1, 2]
    assert fusion.misfits([both])[0] < 1e-12
    d.qpos[7] += 1e-5
    mujoco.mj_forward(m, d)
    assert fusion.misfits([both])[0] == pytest.approx(1e-5)
    assert fusion.misfits([[1], both, [2]]) == pytest.approx([0.0, 1e-5, 0.0])
    d.qpos[7] -= 1e-5
    d.qpos[10:14] = np.cos(5e-4), 0, 0, np.sin(5e-4)
    mujoco.mj_forward(m, d)
    assert fusion.misfits([both])[0] > 1e-3 * 0.1


def test_turns_are_those_of_the_engine() -> None:
    quaternions = np.random.default_rng(6).normal(size=(20, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1)[:, None]
    matrix = np.empty(9)
    for quaternion in quaternions:
        mujoco.mju_quat2Mat(matrix, quaternion)
        found = rotations(quaternion[None])[0].ravel()
        assert np.allclose(found, matrix, rtol=0, atol=1e-15)


GEARBOX = pytest.param("gearbox", 1e-4, marks=pytest.mark.slow)


@pytest.mark.parametrize(
    ("name", "least"), [("paper", 1e-6), ("lamp", 1e-5), ("fence", 1e-6), GEARBOX]
)
def test_a_fused_run_agrees_with_the_unfused(name: str, least: float) -> None:
    """What is rounded away is some of it, `least` [mm]: by the lamp's seeds 0.5e-4 to 1.8e-4."""
    fine = Settings(timestep=0.002)
    one, other = (ready(name, seed=2, settings=fine, fuse=f) for f in (False, True))
    apart, fused = one.run(), other.run()
    assert fused.products == apart.products == 2
    assert [e.transition for e in fused.events] == [e.transition for e in apart.events]
    assert all(abs(a.t - b.t) < 0.021 for a, b in zip(apart.events, fused.events, strict=True))
    assert fused.physics and apart.physics
    assert fused.physics.fused and not apart.physics.fused
    assert fused.physics.unintended_contacts == 0
    assert fused.physics.handoffs < apart.physics.handoffs
    gap = fused.physics.handoff_gap_max_mm
    assert gap == pytest.approx(apart.physics.handoff_gap_max_mm, abs=0.01)
    error = fused.physics.product_error_max_mm
    assert error is not None and least < error < 0.002, (
        "what is rounded away when bodies become one"
    )
    assert other.model and one.model and other.model.bodies != one.model.bodies


def test_mass_and_inertia_add_up() -> None:
    layout = layout_of("gearbox")
    bodies = bodies_of(layout.factory, layout.product, True)
    root = bodies.wholes[layout.factory.pag.root]
    assert root.mass == pytest.approx(layout.product.mass)
    solids = [layout.product.solids[part] for part in root.parts]
    centre = sum(s.mass * s.centre for s in solids) / root.mass
    assert np.allclose(root.centre, centre)
    away = [s.centre - centre for s in solids]
    inertia = sum(
        s.inertia + s.mass * (r @ r * np.eye(3) - np.outer(r, r))
        for s, r in zip(solids, away, strict=True)
    )
    assert np.allclose(root.inertia, inertia)
    for label, radius in bodies.radius.items():
        corners = np.concatenate([layout.product.solids[p].corners for p in bodies.parts(label)])
        assert np.linalg.norm(corners - bodies.centre[label], axis=1).max() <= radius + 1e-12


def test_specks_far_apart_are_a_body_that_the_engine_takes() -> None:
    """Alone they are round; together they are a thread, or a sheet if there are three."""
    layout = laid_out(
        "root = d; d = mate(a, b, c); a = atomic(sphere = 1e-4);"
        "b = atomic(sphere = 1e-4, pos = (900, 50, 0));"
        "c = atomic(sphere = 1e-4, pos = (0, 800, 0))"
    )
    model = physical_model(layout, 1, fuse=True)
    assert len(model.carried.wholes) == 2
    mujoco.MjModel.from_xml_string(model.xml)


def test_what_is_only_worked_upon_stays_the_body_that_it_is() -> None:
    layout = laid_out(
        "root = c; c = weld(b); b = mate(a, d); a = weld(e); e = atomic(); d = atomic()"
    )
    bodies = bodies_of(layout.factory, layout.product, True)
    assert dict(bodies.carried) == {
        "e": ("e",), "a": ("e",), "d": ("d",), "b": ("b",), "c": ("b",),
    }  # fmt: skip
    copies = fused_copies(bodies, layout.factory, None)
    assert copies == {"e": 2, "d": 2, "b": 2}
    run = Simulation(layout, RunRequest(units=3, fuse=True)).run()
    assert run.products == 3 and run.physics and run.physics.unintended_contacts == 0


@pytest.mark.parametrize("name", ["paper", "lamp"])
def test_the_monitor_explains_a_fused_run(name: str) -> None:
    simulation = Simulation(layout_of(name), RunRequest(units=3, jitter=0.3, seed=1, fuse=True))
    monitor = beside(simulation)
    run = simulation.run([monitor.observe])
    report = monitor.report()
    assert run.products == 3
    assert report.refines_net, [str(v) for v in report.violations]


def test_the_monitor_catches_a_body_made_of_another_unit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Planted: the product appears in the output robot's hands, but one input stays there."""
    simulation = Simulation(layout_of("paper"), RunRequest(units=2, fuse=True))
    parts, put_away = simulation.physical.parts, Holdings.put_away
    kept: list[str] = []

    def faulty(self: Holdings, bodies: Iterable[int]) -> None:
        bodies = [*bodies]
        labels = [parts.holdings.of(body).label for body in bodies]
        put_away(self, bodies)
        if "part1" in labels and not kept:
            kept.append("part1")
            robot = simulation.layout.factory.by_label["sub1"].carrier
            grip = parts.holdings.weld[robot_code(robot), "part1"]
            parts.welds.open([parts.holdings.parking[parts.holdings.free["part1"][0]][0]])
            parts.welds.close({grip: int(simulation.physical.m.eq_obj2id[grip])})

    monkeypatch.setattr(Holdings, "put_away", faulty)
    monitor = beside(simulation)
    simulation.run([monitor.observe], max_time=20)
    assert kept and not monitor.report().refines_net


def fuses(folder: Path, text: str) -> bool:
    file = folder / "product.pag"
    file.write_text(text)
    made = factory.compile(factory.load_pag(file))
    return fusing_pays(made, product_geometry(made.pag))


def test_large_factories_are_fused_by_themselves(tmp_path: Path) -> None:
    small, many = layout_of("balanced"), layout_of("gearbox")
    assert len(small.factory.robots) < FUSE_FROM
    assert not fusing_pays(small.factory, small.product)
    tree = "root = n1;\n" + "".join(f"n{k} = mate(n{2 * k}, n{2 * k + 1});\n" for k in range(1, 64))
    assert fuses(tmp_path, tree + ";\n".join(f"n{k} = atomic()" for k in range(64, 128)))
    chain = "root = n239;\nn1 = mate(q0, q1);\n"
    chain += "".join(f"n{k} = mate(n{k - 1}, q{k});\n" for k in range(2, 240))
    assert not fuses(tmp_path, chain + ";\n".join(f"q{n} = atomic()" for n in range(240)))
    with pytest.MonkeyPatch.context() as patch:  # convex pieces count, not parts
        patch.setattr("factory.apps.runs.options.FUSE_FROM", 1)
        assert fusing_pays(small.factory, small.product)
        assert not fusing_pays(many.factory, many.product)


def test_run_says_that_it_fuses(run: Terminal, tmp_path: Path) -> None:
    assert run("run", PAPER, "--fuse", "--json").json["fused"] is True
    assert run("run", PAPER, "--json").json["fused"] is False
    log = tmp_path / "run.log"
    said = run("run", PAPER, "--fuse", "--monitor", "--log", log).out
    assert "parts joined for good are merged into one rigid body" in said
    assert "consistent with the net" in said
    assert "consistent with the net" in run("monitor", log).out


@pytest.mark.parametrize("first", ["consumer", "maker"])
def test_a_body_that_has_just_become_free_can_take_the_place_of_others(
    first: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The only copy of a sub-assembly is still joined to something else when the next one is
    made; both become one in the same tick, in either order."""
    monkeypatch.setattr("factory.engine.simulation.mujoco.parts.SETTLING", np.inf)
    simulation = Simulation(layout_of("chest"), RunRequest(units=4, fuse=True))
    world, parts = simulation.physical, simulation.physical.parts
    holdings = parts.holdings
    found: list[tuple[int, int]] = []
    while not found:
        simulation.supervisor.step()
        assert world.time < 60
        made = {robot: label for robot, (label, _) in parts.joining.waiting.items()}
        found = [
            (consumer, maker)
            for maker, label in made.items()
            if not holdings.free[label]
            for consumer in made
            if label in holdings.hand(consumer)
        ]
    consumer, maker = found[0]
    held = [*holdings.hand(maker).values()]
    unit = holdings.of(held[0]).unit
    centre = world.m.body_mass[held] @ world.d.xpos[held] / world.m.body_mass[held].sum()
    parts.joining.fuse([consumer, maker] if first == "consumer" else [maker, consumer])
    parts.welds.write()
    (label,) = holdings.hand(maker)
    at = world.m.jnt_qposadr[world.m.body_jntadr[holdings[label, unit]]]
    assert np.linalg.norm(world.d.qpos[at : at + 3] - centre) < 0.005
    done = simulation.run()
    assert done.products == 4 and done.physics and done.physics.unintended_contacts == 0


def test_what_has_not_settled_is_not_one_body_yet(monkeypatch: pytest.MonkeyPatch) -> None:
    """It becomes one when its parts are within RIGID of their places, or when its robot's next
    operation ends; its misfit is kept, and is part of the product's error."""
    simulation = ready("paper", fuse=True)
    world, joining = simulation.physical, simulation.physical.parts.joining
    monkeypatch.setattr("factory.engine.simulation.mujoco.parts.RIGID", 0.0)
    waited: list[float] = []
    while not world.delivered():
        simulation.supervisor.step()
        waited += [world.time - since for _, since in joining.waiting.values()]
    late = max(waited)
    error = world.figures().product_error_max_mm
    monkeypatch.undo()
    simulation = ready("paper", fuse=True)
    world, joining = simulation.physical, simulation.physical.parts.joining
    waited = []
    while not world.delivered():
        simulation.supervisor.step()
        waited += [world.time - since for _, since in joining.waiting.values()]
    assert SETTLING < max(waited) < 0.3 < late
    assert error is not None and 0.0 < error < 0.002


INTERLOCKED = """root = s2; s2 = mate(s1, c); s1 = mate(a, b);
a = atomic(box = (0.02, 0.02, 0.02), pos = (0.0, 0.0, 0.01));
b = atomic(box = (0.02, 0.02, 0.02), pos = (0.02, 0.0, 0.01));
c = atomic(box = (0.02, 0.02, 0.02), pos = (0.03, 0.01, 0.01));"""


def test_what_has_not_settled_is_left_out_of_contact_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """`b` and `c` have 10 mm in common. They do not touch on the way, whether `b` is one body with
    `a` by then or not."""
    layout = laid_out(INTERLOCKED)
    for settles in (True, False):
        if not settles:
            monkeypatch.setattr("factory.engine.simulation.mujoco.parts.SETTLING", np.inf)
        run = Simulation(layout, RunRequest(units=2, fuse=True)).run()
        assert run.products == 2 and run.physics and run.physics.excluded == (("b", "c"),)
        assert run.physics.unintended_contacts == 0 and not run.physics.mating_forces.get("s2")


def test_a_misfit_is_part_of_the_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted: parts are 3 mm out of place when they become one body."""
    misfits = Fusion.misfits
    monkeypatch.setattr(Fusion, "misfits", lambda self, groups: misfits(self, groups) + 3e-3)
    simulation = ready("paper", fuse=True, units=1)
    run = simulation.run()
    assert run.physics is not None
    assert run.physics.product_error_max_mm == pytest.approx(3.0, abs=0.01)


def test_a_fusion_that_loses_momentum_shows() -> None:
    """Planted: a body of other mass than those in whose place it is has another momentum."""
    m, d, whole = free_bodies(np.random.default_rng(3), 2)
    d.qvel[:12] = 1.0
    m.body_mass[whole] *= 1.1
    before = momentum(m, d, [1, 2])
    nowhere(m, d).fuse([1, 2], whole)
    assert not np.allclose(momentum(m, d, [whole]), before, atol=1e-3)


@pytest.mark.parametrize("knows", [True, False])
def test_what_sleeps_is_asked_once_whether_it_has_settled(
    knows: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Until it wakes nothing of it changes. Planted fault: nobody knows that it sleeps."""
    if not knows:
        monkeypatch.setattr(Fusion, "sleeps", lambda *_: False)
    simulation = ready("20", fuse=True, settings=Settings(timestep=0.01, substeps=1), units=4)
    world, asked = simulation.physical, dict[tuple[int, ...], list[float]]()
    misfits = Fusion.misfits

    def counting(self: Fusion, groups: Sequence[Sequence[int]]) -> np.ndarray:
        for group in groups:
            tree = world.m.body_treeid[group[0]]
            if world.d.tree_asleep[tree] >= 0:
                asked.setdefault(tuple(group), []).append(world.time)
        return misfits(self, groups)

    monkeypatch.setattr(Fusion, "misfits", counting)
    while world.delivered() < 2:
        simulation.supervisor.step(MOST)
    assert (max(map(len, asked.values())) <= 4) == knows
