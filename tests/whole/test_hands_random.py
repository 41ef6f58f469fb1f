"""Hands on random products: they hold, and meet nothing."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import pytest

from factory.apps.few_robots.aim import Aim
from factory.apps.few_robots.search import allocated
from factory.apps.fidelity.hidden import HiddenPenetrations
from factory.apps.runs.watched import watched
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.certificate import fault
from factory.floor.layout.dimensions import TOOL_TRAVEL
from factory.floor.layout.embedding import certified
from factory.floor.layout.shapes import is_tool
from factory.floor.modes.modes import operation_modes
from factory.pipeline import Project, read
from factory.support.errors import RunError
from factory.support.settings import LEAST
from factory.theory.problem.plan import Plan
from tests.drawn_products import drawn_product
from tests.random_products import random_blocks, random_product

AT_MOST_MM, GRIP_MM = 0.1, 0.5
"""How deep anything that is drawn may be in anything, and how far a grip may be."""

CROSSED = """
root = s7; s7 = mate ( s3, s6 ); s3 = mate ( p1, p2, p3 ); s6 = mate ( s4, p6 );
s4 = mate ( p4, p5 ); p1 = atomic(); p2 = atomic(); p3 = atomic(); p4 = atomic(); p5 = atomic();
p6 = atomic()
"""
"""A carrier's pad is broader than its mast: another hand reaches over its line."""

SPOOL = """
root = s3; s1 = mate ( p3, p2 ); s2 = insert ( p1, s1 ); s3 = press ( s2 );
p1 = atomic ( box = (0.08, 0.08, 0.09), pos = (0, 0, 0.045) );
p2 = atomic ( box = (0.08, 0.026, 0.06), pos = (0, 0, 0.12) );
p3 = atomic ( box = (0.08, 0.08, 0.04), pos = (0, 0, 0.17) )
"""
"""A hand behind could hold the core of what it lowers, below its rim, and then rises."""

WIDE = """
root = s1; s1 = mate ( p0, p1, p2, p3, p4, p5 );
p0 = atomic ( box = (0.02, 0.06, 0.04), pos = (0, 0, 0.02) );
p1 = atomic ( box = (0.06, 0.02, 0.04), pos = (0.023, -0.023, 0.0605) );
p2 = atomic ( cylinder = (0.01, 0.04), pos = (-0.0175, -0.013, 0.0605) );
p3 = atomic ( sphere = 0.015, pos = (0.013, -0.0455, 0.015) );
p4 = atomic ( box = (0.01, 0.01, 0.03), pos = (0.042, -0.019, 0.096) );
p5 = atomic ( cylinder = (0.02, 0.04), pos = (-0.0025, 0.018, 0.0605) )
"""
"""A pad as wide as its part is high holds it from behind, and reached into the outfeed's tray."""


BALL = """
root = s3; s1 = mate ( p1, p0 ); s2 = mate ( s1, p2 ); s3 = mate ( s2, p3 );
p0 = atomic ( sphere = 0.00225, pos = ( 0, 0, 0.00225 ), density = 2700 );
p1 = atomic ( box = (0.0015, 0.003, 0.0045), pos = (-0.00225, -0.0039, 0.00225), density = 2700 );
p2 = atomic ( box = (0.006, 0.006, 0.015), pos = (0.00045, 0.0003, 0.01215), density = 2700 );
p3 = atomic ( box = (0.0015, 0.0015, 0.009), pos = (-0.00165, -0.0063, 0.0045), density = 2700 )
"""
"""The carrier's pad, beside the lowest point of a ball that is brought, passes below that."""


def project_of(text: str, folder: Path) -> Project:
    """The project of a text."""
    file = folder / "product.pag"
    file.write_text(text)
    return read(file)


def succeeds(project: Project, seed: int, units: int, jitter: float) -> None:
    """A run of a project succeeds, with everything made solid, too."""
    request = RunRequest(units=units, seed=seed, jitter=jitter)
    simulation = Simulation(project.layout, request)
    hidden = HiddenPenetrations.of(simulation)
    look = [lambda state: hidden.look(state.observation.qpos, state.time)]
    run = watched(simulation, look, 600.0)
    assert run.succeeded, run.verdict.failures
    assert run.physics is not None
    assert (run.physics.grip_gap_max_mm or 0.0) < GRIP_MM
    assert (run.physics.grip_strength_share_max or 0.0) < 1
    deep = hidden.found()
    assert max((p.depth_mm for p in deep), default=0.0) < AT_MOST_MM, deep


@pytest.mark.parametrize(
    ("text", "units"),
    [(CROSSED, 1), (SPOOL, 2), (WIDE, 1), (BALL, 2)],
    ids=["crossed", "spool", "wide", "ball"],
)
def test_hands_that_met(text: str, units: int, tmp_path: Path) -> None:
    succeeds(project_of(text, tmp_path), 0, units, 0.0)


MET = {
    2471: "a finger is broader than its pad",
    2418: "a bar under what its carrier takes is in the way of the carrier's column",
    2269: "a hand stays where a part comes down later",
    3171: "a lift rises beside what its carrier takes along",
    3287: "what is lowered comes before the carrier's hand",
    2499: "a lift rises through what is brought",
    2611261150: "what a lift raises its hand from is higher than that beside it",
    261125186: "what waits is beside a hand that reaches over the line",
    2611270266: "a hand above is narrower than its beam, which what is lowered meets",
}
"""Random products whose hands met, each for a cause of its own."""

MET_LATER = {
    2316: "what is lowered from behind passes the carrier's bar",
    2341: "a carrier's column goes through another's bar",
    3040: "a tower stands where a carrier comes with more",
    2257: "a tray is so high that the shutter is down on it",
}
"""More of these, that take longer."""


@pytest.mark.parametrize(
    "seed",
    [*MET, *(pytest.param(seed, marks=pytest.mark.slow) for seed in MET_LATER)],
)
def test_random_products_whose_hands_met(seed: int, tmp_path: Path) -> None:
    succeeds(project_of(random_product(seed), tmp_path), seed, 2, 0.3 * (seed == 3287))


def test_a_ball_comes_down_past_the_pad_that_holds_it_over_its_middle(tmp_path: Path) -> None:
    succeeds(project_of(random_blocks(2611320180), tmp_path), 2611320180, 2, 0.3)


DAY = int(os.environ.get("TEST_DAY", "261126"))
"""Year, month and day whose seeds are drawn; `make test` says today's."""


@pytest.mark.parametrize("seed", [1000 * DAY + number for number in range(8)])
def test_the_default_path(seed: int, tmp_path: Path) -> None:
    """What `factory run` makes of any product that can be joined: production without a fault."""
    text = random_blocks(seed) if seed % 4 == 0 else random_product(seed)
    request = RunRequest(units=5, seed=seed, jitter=0.3)
    run = watched(Simulation(project_of(text, tmp_path).layout, request))
    assert run.succeeded, run.verdict.failures


BY_A_HAIR = """
root = s8; s1 = mate ( p1, p2 ); s2 = mate ( s1, p3, p4 ); s3 = mate ( p5, p6 );
s4 = weld ( s3, dwell = 0.3 ); s5 = mate ( p7, p8 ); s6 = mate ( p9, p10 ); s7 = mate ( s5, s6 );
s8 = mate ( s2, s4, s7 );
p1 = atomic ( box = ( 0.1186, 0.0574, 0.0388 ), pos = ( 0.0593, 0.0287, 0.0194 ) );
p2 = atomic ( box = ( 0.1186, 0.0574, 0.0356 ), pos = ( 0.0593, 0.0287, 0.0566 ) );
p3 = atomic ( box = ( 0.1186, 0.045, 0.0744 ), pos = ( 0.0593, 0.0799, 0.0372 ) );
p4 = atomic ( box = ( 0.1186, 0.038, 0.0744 ), pos = ( 0.0593, 0.1214, 0.0372 ) );
p5 = atomic ( box = ( 0.1186, 0.0738, 0.0526 ), pos = ( 0.0593, 0.0369, 0.1007 ) );
p6 = atomic ( box = ( 0.1186, 0.0665, 0.0526 ), pos = ( 0.0593, 0.10705, 0.1007 ) );
p7 = atomic ( box = ( 0.0719, 0.0663, 0.0705 ), pos = ( 0.03595, 0.03315, 0.16225 ) );
p8 = atomic ( box = ( 0.0467, 0.0663, 0.0705 ), pos = ( 0.09525, 0.03315, 0.16225 ) );
p9 = atomic ( box = ( 0.0486, 0.074, 0.0705 ), pos = ( 0.0243, 0.1033, 0.16225 ) );
p10 = atomic ( box = ( 0.07, 0.074, 0.0705 ), pos = ( 0.0836, 0.1033, 0.16225 ) );
"""
"""The rear of p6 is 0.1 mm ahead of that of p4 under it."""

SHEETS = """
root = u7;
u1 = mate ( p1, p2 );
u2 = mate ( u1, p3 );
u3 = mate ( u2, p4 );
u4 = mate ( u3, p5 );
u5 = mate ( u4, p6 );
u6 = mate ( u5, p7 );
u7 = mate ( u6, p8 );
p1 = atomic ( box = ( 0.01476566, 0.01423379, 0.0002 ), pos = (0, 0, 0.0001 ), density = 700 );
p2 = atomic ( box = ( 0.01614489, 0.01556334, 0.0001 ), pos = (0, 0, 0.00025 ), density = 700 );
p3 = atomic ( box = ( 0.01395501, 0.01345234, 0.0006 ), pos = (0, 0, 0.0006 ), density = 700 );
p4 = atomic ( box = ( 0.01705306, 0.0164388, 0.0003 ), pos = (0, 0, 0.00105 ), density = 700 );
p5 = atomic ( box = ( 0.01716914, 0.0165507, 0.0002 ), pos = (0, 0, 0.0013 ), density = 700 );
p6 = atomic ( box = ( 0.01580761, 0.01523821, 0.0001 ), pos = (0, 0, 0.00145 ), density = 700 );
p7 = atomic ( box = ( 0.01273689, 0.0122781, 8e-05 ), pos = (0, 0, 0.00154 ), density = 700 );
p8 = atomic ( box = ( 0.0138956, 0.01339508, 0.0002 ), pos = (0, 0, 0.00168 ), density = 700 )
"""
"""Of these sheets one has an edge of 80 µm."""


@pytest.mark.parametrize("text", [BY_A_HAIR, SHEETS])
def test_a_face_has_room_to_what_other_robots_hold(text: str, tmp_path: Path) -> None:
    """Such layouts were refused by 0.05 mm, or ended without a place to choose from."""
    layout = project_of(text, tmp_path).layout
    assert layout.certificate is not None and layout.certificate.holds


def test_a_missing_hand_is_the_reason_why_robots_meet(tmp_path: Path) -> None:
    text = """
    root = c; c = mate ( a, s ); a = atomic ( box = ( 0.05, 0.05, 0.05 ), pos = ( 0, 0, 0.025 ) );
    s = atomic ( sphere = 0.0006, pos = ( 0.0256, 0, 0.025 ) );
    """
    layout = project_of(text, tmp_path).layout
    (bare,) = (n for n, hand in enumerate(layout.hands) if hand and hand.kind == "none")
    assert layout.certificate is not None
    for robots, code in (((0, bare), "NoGrip"), ((0, 1), "Layout")):
        met = fault(layout.factory, "they meet", *robots)
        with pytest.raises(RunError, match=code):
            certified(layout, None, replace(layout.certificate, faults=(met,)))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 160))
def test_hands_hold_and_meet_nothing(seed: int, tmp_path: Path) -> None:
    text = random_blocks(seed) if seed % 4 == 0 else random_product(seed)
    succeeds(project_of(text, tmp_path), seed, 3 - 2 * (seed // 2 % 2), 0.3 * (seed % 2))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(200, 220))
def test_hands_of_few_robots_meet_nothing(seed: int, tmp_path: Path) -> None:
    project = allocated(project_of(random_blocks(seed), tmp_path), Aim(LEAST, effort=12))
    succeeds(project, seed, 3, 0.3 * (seed % 2))


def test_a_tool_comes_from_behind_what_is_held_nearer_to_it(tmp_path: Path) -> None:
    """A carrier that holds one part in another place than the next stands so that the tool stops
    early for one of them: its home is farther out than that."""
    forms = {"s6/2": 0, "s4/2": 1, "s5/2": 1, "s3": 0, "s1": 0}
    turns = ((0, 1, 1, 2, 3, 3, 4, 5, 6, 6, 6),)
    project = project_of(random_product(2611280006), tmp_path)
    layout = project.with_plan(Plan(forms, {}, turns)).layout
    (tool,) = (robot for robot in layout.factory.robots if is_tool(layout.factory, robot.index))
    (weld,) = tool.operations
    slot = layout.factory.operations[weld].robots.index(tool.index)
    assert layout.stop_offset(weld, slot)[0] > 0
    stands = layout.goals(weld)[slot]
    assert layout.guidepaths[tool.index].length - stands >= TOOL_TRAVEL


@pytest.mark.slow
def test_a_tool_may_be_farther_than_its_goal_when_an_operation_begins(tmp_path: Path) -> None:
    """On its way home from the one before, for which it stopped later: factories with it that the
    search looks at were refused as NotPrepared, and with them the product."""
    project = project_of(random_product(2611330026), tmp_path)
    succeeds(allocated(project, Aim(LEAST, effort=12)), 2611330026, 2, 0.3)


def test_a_candidate_in_which_an_operation_cannot_begin_is_left_out(tmp_path: Path) -> None:
    """The search for least robots ended in its NotPrepared."""
    project = allocated(project_of(random_product(291430003), tmp_path), Aim(LEAST))
    assert (
        operation_modes(project.layout, project.settings.eps) and len(project.planned.robots) == 8
    )


def test_what_is_lowered_passes_the_beam_over_a_part_of_a_feeder(tmp_path: Path) -> None:
    """Its mast stands beside the part, so the beam reaches to there: the layout was refused."""
    project = read(drawn_product(291310070).write(tmp_path))
    run = Simulation(project.layout, RunRequest(units=1, jitter=0.3)).run()
    assert run.verdict.succeeded
