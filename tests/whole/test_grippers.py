"""Grippers whose fingers close, as a package brings them: the one that the page about extensions
shows, and what is refused."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from factory.api import RunRequest, Simulation, State
from factory.engine.simulation.mujoco.world import MujocoWorld
from factory.floor.layout.hands.clamp import Clamp
from factory.floor.layout.hands.limbs import limbs
from factory.floor.layout.hands.reach import AIR
from factory.floor.layout.hands.tips import shares
from factory.floor.layout.layout import Layout
from factory.pipeline import Project, read
from factory.support.errors import InputError
from factory.support.extensions import extensions
from factory.theory.plant.gripping import closing_time
from factory.theory.problem.robot_bodies import Jaw
from factory.theory.problem.robot_reader import read_body
from tests.paths import ROOT

PAGE = (ROOT / "docs" / "guide" / "extending.md").read_text("utf-8")
SECTION = PAGE.partition("### A gripper with fingers")[2].partition("\n##")[0]
JAWS, DRIVES, CATALOGUE, CLASP, PRODUCT = re.findall(
    r"^```(?:xml|toml|text)\n(.*?)^```$", SECTION, re.M | re.S
)


def with_jaws(model: str, name: str) -> str:
    """The MJCF of a shipped type with the jaws that the page shows."""
    text = (ROOT / "mjcf" / model).read_text("utf-8")
    text = text.replace(f'model="{model.removesuffix(".xml")}"', f'model="{name}"')
    text = re.sub(r"^ *<site ", lambda site: JAWS + site[0], text, flags=re.M)
    return re.sub(r"^ *</actuator>", lambda end: DRIVES + end[0], text, flags=re.M)


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The package of the page as if it were installed, and one of its robots on a lift."""
    inside, about = tmp_path / "clasping", tmp_path / "clasping-1.0.dist-info"
    inside.mkdir()
    about.mkdir()
    lifting = CATALOGUE.replace("gripper", "grablift").replace('"dot"', '"lift"')
    (inside / "__init__.py").touch()
    (inside / "catalogue.toml").write_text(CATALOGUE + lifting)
    (inside / "gripper.xml").write_text(with_jaws("dot.xml", "gripper"))
    (inside / "grablift.xml").write_text(with_jaws("lift.xml", "grablift"))
    (inside / "clasp.op").write_text(CLASP)
    (inside / "grab.op").write_text(CLASP.replace("clasp", "grab").replace("gripper", "grablift"))
    (about / "METADATA").write_text("Name: clasping\nVersion: 1.0\n")
    groups = ("[factory.robots]", "[factory.templates]")
    (about / "entry_points.txt").write_text("\n".join(f"{g}\nclasping = clasping" for g in groups))
    monkeypatch.syspath_prepend(tmp_path)
    extensions.cache_clear()
    yield tmp_path
    extensions.cache_clear()
    for name in [name for name in sys.modules if name.partition(".")[0] == "clasping"]:
        del sys.modules[name]


def project(folder: Path, text: str = PRODUCT) -> Project:
    """The project of a product."""
    file = folder / "p.pag"
    file.write_text(text)
    return read(file)


LIFTED = PRODUCT.replace("clasp", "grab").replace("(0, 0.055, 0.01)", "(0, 0.042, 0.03)")
ROUND = PRODUCT.replace("box = (0.024, 0.03, 0.02)", "cylinder = (0.012, 0.02)").replace(
    "0.055", "0.0521"
)


class Watch:
    """What the jaws of robot r3 do: at each tick whether its robot moves, what holds the part, and
    how far the jaws are from it [m]."""

    def __init__(self, made: Simulation) -> None:
        self.made, self.rows = made, list[tuple[bool, bool, float, float]]()

    def __call__(self, state: State) -> None:
        world = self.made.world
        assert isinstance(world, MujocoWorld)
        m, d = world.m, world.d
        jaws = [m.joint(f"r3/{name}").qposadr[0] for name in ("left", "right")]
        still = abs(d.qvel[m.joint("r3/slide").dofadr[0]]) < 0.01
        held = [*world.parts.holdings.hand(2).values()]
        faces = [m.geom(f"r3/{name}/jaw").id for name in ("left", "right")]
        away = [
            mujoco.mj_geomDistance(m, d, face, int(geom), 0.1, None)
            for body in held
            for geom in m.body_geomadr[body] + np.arange(m.body_geomnum[body])
            for face in faces
            if m.geom_contype[geom]
        ]
        self.rows.append(
            (bool(still), bool(held), max(away, default=0.0), float(d.qpos[jaws].max()))
        )


@pytest.mark.parametrize("text", [PRODUCT, LIFTED, ROUND], ids=["dot", "on a lift", "round"])
def test_fingers_close_before_the_robot_goes_and_touch_nothing(package: Path, text: str) -> None:
    """20 units, every robot's speed and gain drawn within 30 %."""
    made = project(package, text)
    hand = made.layout.hand(2)
    assert hand is not None and hand.clamp is not None
    assert (hand.kind, made.factory.lowers(2)) == (
        ("above", True) if text == LIFTED else ("below", False)
    )
    simulation = Simulation(made.layout, RunRequest("mujoco", units=20, jitter=0.3, seed=1))
    watch = Watch(simulation)
    run = simulation.run([watch])
    figures = run.physics
    assert run.succeeded and figures is not None, run.verdict
    assert figures.unintended_contacts == 0 and figures.handoff_gap_max_mm <= 0.05
    carried = np.array([(away, closed) for _, held, away, closed in watch.rows if held])
    assert len(carried) > 200
    assert carried[:, 0].min() > AIR - 1e-4 and carried[:, 0].max() < AIR + 1e-4
    assert max(closed for *_, closed in watch.rows) < carried[:, 1].min() + 1e-4
    closing = [still for still, held, _, closed in watch.rows if not held and closed > 1e-3]
    assert sum(closing) > 20 * 3  # while the robot stands, some ticks for each unit
    moving = [closed for still, held, _, closed in watch.rows if not still and not held]
    assert min(moving) < 1e-4  # and open on its way home


def test_an_operation_that_jaws_take_part_in_dwells(package: Path) -> None:
    factory = project(package).factory
    dwells = {o.label: o.dwell for o in factory.operations}
    body = factory.robots[2].body
    assert dwells == {"pair": 0.0, "base": 0.0, "cube": closing_time(body), "dropoff": 0.0}
    assert 0.22 < closing_time(body) < 0.3  # 12 mm at 0.1 m/s, both ramps of 1 m/s², and to spare


def test_two_worlds_and_two_steppings_agree(package: Path) -> None:
    """Jaws move on their own, whatever the number of ticks in a call of the engine."""
    layout = project(package).layout
    runs = [
        Simulation(layout, RunRequest("mujoco", units=3, fast=fast)).run([])
        for fast in (True, False)
    ]
    assert runs[0].events == runs[1].events
    ideal = Simulation(layout, RunRequest("ideal", units=3)).run([])
    assert sorted(e.transition for e in ideal.events) == sorted(
        e.transition for e in runs[0].events
    )


def test_robots_with_programs_of_their_own_close_their_jaws(package: Path) -> None:
    request = RunRequest("mujoco", units=3, jitter=0.3, seed=1, distributed=True)
    run = Simulation(project(package).layout, request).run([])
    assert run.succeeded and run.physics is not None, run.verdict
    assert run.physics.unintended_contacts == 0


def spoiled(made: Project, by: float) -> Layout:
    """The layout with jaws that close too far by some length [m]."""
    hands = list(made.layout.hands)
    hand = hands[2]
    assert hand is not None and hand.clamp is not None
    closed = tuple(tuple(x + by for x in tour) for tour in hand.clamp.closed)
    hands[2] = replace(hand, clamp=replace(hand.clamp, closed=closed))
    return replace(made.layout, hands=tuple(hands))


@pytest.mark.parametrize(("by", "why"), [(-1e-3, "GripGap"), (1e-3, "Contact")])
def test_jaws_that_close_too_little_or_too_far_fail_the_run(
    package: Path, by: float, why: str
) -> None:
    layout = spoiled(project(package), by)
    run = Simulation(layout, RunRequest("mujoco", units=2)).run([])
    assert not run.succeeded and why in str(run.verdict), run.verdict


@pytest.mark.parametrize("text", [PRODUCT, LIFTED], ids=["dot", "on a lift"])
def test_jaws_stay_within_the_boxes_that_were_certified(package: Path, text: str) -> None:
    made = project(package, text)
    simulation = Simulation(made.layout, RunRequest("mujoco", units=2, jitter=0.3, seed=2))
    boxes = {limb.name: limb for limb in limbs(made.layout, 2)}
    off = list[float]()

    def look(state: State) -> None:
        world = simulation.world
        assert isinstance(world, MujocoWorld)
        m, d = world.m, world.d
        foot = m.body("r3/carriage").id
        turn = d.xmat[foot].reshape(3, 3)
        for name in ("left", "right"):
            limb, geom = boxes[f"{name}/jaw"], m.geom(f"r3/{name}/jaw").id
            at = turn.T @ (d.geom_xpos[geom] - d.xpos[foot])
            if text == LIFTED:
                at[2] -= d.xpos[m.body("r3/head").id, 2] - d.xpos[foot, 2]
            low, high = at - m.geom_size[geom], at + m.geom_size[geom]
            off.append(float(max((limb.low - low).max(), (high - limb.high).max())))

    simulation.run([look])
    assert max(off) < 1e-4


@pytest.mark.parametrize("up", [1, -1], ids=["from below", "hanging"])
def test_the_strength_of_jaws_is_friction_at_both_faces(up: int) -> None:
    jaws = tuple(
        Jaw(name, side, (-0.01, y, 0.0), (0.01, y + 0.004, 0.02), 0.02, 0.1, 0.0, 0.0, 25.0, 0.4)
        for name, side, y in (("left", 1, 0.03), ("right", -1, -0.034))
    )
    clamp = Clamp(jaws, ((0.01, 0.01),), up)

    def used(force: tuple[float, ...], moment: tuple[float, ...] = (0.0, 0.0, 0.0)) -> float:
        """At the middle of the clamp, 10 mm over or under the pad."""
        about = np.array(moment) + np.cross((0.0, 0.0, 0.01 * up), force)
        return float(shares((clamp.gauge((1.0, 0.0)) @ [*force, *about])[None])[0])

    assert used((0.0, 0.0, -10.0)) == pytest.approx(10 / (2 * 0.4 * 25))
    assert used((3.0, 0.0, -4.0)) == pytest.approx(5 / (2 * 0.4 * 25))
    assert used((0.0, 10.0, 0.0)) == pytest.approx(10 / (2 * 25))
    assert used((0.0, 0.0, 0.0), (0.0, 0.0, 0.1)) == pytest.approx(0.1 / (0.04 * 0.4 * 25))
    twist = 1.5 * 0.05 / 0.01 / (2 * 0.4 * 25)
    assert used((0.0, 0.0, 0.0), (0.0, 0.05, 0.0)) == pytest.approx(twist)


@pytest.mark.parametrize(
    ("text", "by"),
    [
        ("box = (0.024, 0.03", "box = (0.0396, 0.03"),  # less than 1 mm between open jaws
        ("box = (0.024, 0.03", "box = (0.0150, 0.03"),  # they do not come so near to each other
        ("box = (0.024, 0.03, 0.02), pos", "box = (0.024, 0.03, 0.02), density = 2e5, pos"),
    ],
    ids=["wide", "narrow", "heavy"],
)
def test_what_jaws_cannot_hold_has_no_grip(package: Path, text: str, by: str) -> None:
    assert text in PRODUCT
    hand = project(package, PRODUCT.replace(text, by)).layout.hand(2)
    assert hand is not None and hand.kind == "none"


@pytest.mark.parametrize(
    ("text", "by", "why"),
    [
        ('range="0 0.012"', 'range="0 0.06"', "the range [0.0, 0.06]"),
        ('range="0 0.012"', "", "the range []"),
        ('axis="0 -1 0"', 'axis="1 0 0"', "the axis [1.0, 0.0, 0.0]"),
        ('axis="0 -1 0"', 'axis="0 1 0"', "goes 12 mm along [0.0, 1.0, 0.0]"),
        ('forcerange="-20 20"', "", "the actuator of 'left' has joint name"),
        ('pos="0.1 0.022 0.107" mass="0.05"', 'pos="0.1 0.022 0.107"', "the mass 0 kg"),
        ('pos="0.1 0.022 0.107"', 'pos="0.1 0.022 0.15"', "m of the nest"),
        ('pos="0.1 -0.022 0.107"', 'pos="0.1 0.052 0.107"', "goes 12 mm along"),
        ('<joint name="right"', '<joint name="wrong"', "the jaw 'right' has wrong, right"),
    ],
)
def test_what_is_no_jaw_is_refused_at_its_line(
    tmp_path: Path, text: str, by: str, why: str
) -> None:
    whole = with_jaws("dot.xml", "gripper")
    assert text in whole
    file = tmp_path / "gripper.xml"
    file.write_text(whole.replace(text, by, 1))
    with pytest.raises(InputError) as caught:
        read_body("gripper", file)
    first = caught.value.diagnostics[0]
    assert first.code == "BadRobot" and why in first.message and first.hint, first
    assert first.position is not None and first.position.line > 30
