"""Grippers whose fingers close, as a package brings them: the one that the page about extensions
shows, and what is refused."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from factory.api import RunRequest, Simulation, State
from factory.engine.simulation.mujoco.world import MujocoWorld
from factory.floor.layout.hands.clamp import Clamp
from factory.floor.layout.hands.limbs import limbs
from factory.floor.layout.hands.tips import shares
from factory.floor.layout.layout import Layout
from factory.floor.robots.reader import read_body
from factory.pipeline import Project, read
from factory.support.errors import InputError
from factory.support.extensions import extensions
from factory.theory.problem.robot_bodies import Jaw
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


@pytest.mark.parametrize(("by", "why"), [(-1e-3, "GripGap")])
def test_jaws_that_close_too_little_or_too_far_fail_the_run(
    package: Path, by: float, why: str
) -> None:
    layout = spoiled(project(package), by)
    run = Simulation(layout, RunRequest("mujoco", units=2)).run([])
    assert not run.succeeded and why in str(run.verdict), run.verdict


def test_jaws_stay_within_the_boxes_that_were_certified(package: Path) -> None:
    made = project(package, LIFTED)
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
            at[2] -= d.xpos[m.body("r3/head").id, 2] - d.xpos[foot, 2]
            low, high = at - m.geom_size[geom], at + m.geom_size[geom]
            off.append(float(max((limb.low - low).max(), (high - limb.high).max())))

    simulation.run([look])
    assert max(off) < 1e-4


def test_the_strength_of_jaws_is_friction_at_both_faces() -> None:
    jaws = tuple(
        Jaw(name, side, (-0.01, y, 0.0), (0.01, y + 0.004, 0.02), 0.02, 0.1, 0.0, 0.0, 25.0, 0.4)
        for name, side, y in (("left", 1, 0.03), ("right", -1, -0.034))
    )
    clamp = Clamp(jaws, ((0.01, 0.01),), 1)

    def used(force: tuple[float, ...], moment: tuple[float, ...] = (0.0, 0.0, 0.0)) -> float:
        """At the middle of the clamp, 10 mm over the pad."""
        about = np.array(moment) + np.cross((0.0, 0.0, 0.01), force)
        return float(shares((clamp.gauge((1.0, 0.0)) @ [*force, *about])[None])[0])

    assert used((0.0, 0.0, -10.0)) == pytest.approx(10 / (2 * 0.4 * 25))
    assert used((3.0, 0.0, -4.0)) == pytest.approx(5 / (2 * 0.4 * 25))
    assert used((0.0, 10.0, 0.0)) == pytest.approx(10 / (2 * 25))
    assert used((0.0, 0.0, 0.0), (0.0, 0.0, 0.1)) == pytest.approx(0.1 / (0.04 * 0.4 * 25))
    twist = 1.5 * 0.05 / 0.01 / (2 * 0.4 * 25)
    assert used((0.0, 0.0, 0.0), (0.0, 0.05, 0.0)) == pytest.approx(twist)


@pytest.mark.parametrize(
    ("text", "by", "why"),
    [
        ('axis="0 -1 0"', 'axis="1 0 0"', "the axis [1.0, 0.0, 0.0]"),
        ('axis="0 -1 0"', 'axis="0 1 0"', "goes 12 mm along [0.0, 1.0, 0.0]"),
        ('forcerange="-20 20"', "", "the actuator of 'left' has joint name"),
        ('pos="0.1 0.022 0.107" mass="0.05"', 'pos="0.1 0.022 0.107"', "the mass 0 kg"),
        ('pos="0.1 0.022 0.107"', 'pos="0.1 0.022 0.15"', "m of the nest"),
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
