"""Cells with tools and with sub-assemblies: what arms take, in which order, and when carriers
leave."""

from __future__ import annotations

import re
from functools import cache
from unittest.mock import patch

import numpy as np
import pytest

from factory.api import Array, InputError, Project, names
from factory.apps.arms import arrangement, obstacles, planning
from factory.apps.arms.arming import armed, on_rails
from factory.apps.arms.model import ArmModel
from factory.apps.arms.orders import BEYOND
from factory.apps.arms.program_text import program_text
from factory.apps.arms.scene import Scene
from factory.apps.runs.options import RunOptions
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
from factory.pipeline import all_templates
from factory.theory.lang import read_pag
from factory.theory.nets.verify import verify
from tests.arm_cells import SMALL, chains, project, refusal, run

POST = """root = p;
p = inspect ( q, dwell = 0.2 ); q = mate ( a, s );
s = press ( t, dwell = 0.2 ); t = mate ( b, c );
a = atomic ( box = (0.28, 0.06, 0.02), pos = (0, 0, 0.01), density = 500 );
b = atomic ( box = (0.04, 0.04, 0.02), pos = (0.115, 0, 0.0301), density = 1200 );
c = atomic ( box = (0.03, 0.03, 0.02), pos = (0.115, 0, 0.0502), density = 1200 )"""
"""A base, and at its front end a block with a knob, which is pressed on before: the carrier that
brings the block has it ahead of the product's middle."""

ROOF = """root = p;
p = mate ( a, s, d ); s = mate ( b, c );
a = atomic ( box = (0.12, 0.06, 0.02), pos = (0, 0, 0.01), density = 1200 );
b = atomic ( box = (0.04, 0.04, 0.02), pos = (-0.02, 0, 0.0301), density = 1200 );
c = atomic ( box = (0.08, 0.05, 0.01), pos = (0, 0, 0.0452), density = 1200 );
d = atomic ( box = (0.03, 0.03, 0.016), pos = (0.02, 0, 0.0281), density = 1200 )"""
"""A block under a roof that stands on another."""


@cache
def post() -> Layout:
    return project(POST, "six").layout


@cache
def plain(text: str) -> Project:
    templates = all_templates()
    return Project(read_pag(text, templates), templates)


@cache
def six() -> ArmModel:
    """The shipped arm of six axes."""
    return ArmModel.of("six")


def does(layout: Layout, robot: int) -> list[str]:
    """The labels of what a robot does."""
    return [layout.factory.operations[n].label for n in layout.factory.robots[robot].operations]


def test_a_sub_assembly_has_a_carrier_and_a_tool_has_a_place() -> None:
    layout = post()
    types = [robot.type for robot in layout.factory.robots]
    assert types == ["dot", "tool", "dot", "tool", "six"]
    assert does(layout, 2) == ["b", "t", "s", "s/shown", "s/taken"]
    assert does(layout, 4) == ["c", "t", "s/taken", "q"]
    proof = verify(layout.factory.net)
    assert proof.holds and proof.live and proof.safe and proof.reversible


def test_it_is_made_and_nothing_touches() -> None:
    made = run(post(), units=5, jitter=0.3, seed=5)
    assert made.succeeded and made.refines_net and made.products == 5
    assert made.physics is not None and made.physics.unintended_contacts == 0
    assert made.cycle_time_s == pytest.approx(made.predicted_cycle_time_s, rel=0.01)


def test_two_arms_share_what_is_placed() -> None:
    """The first has all that sub-assemblies need; it takes turns with the other at the product."""
    layout = project(ROOF, "six=2").layout
    arms = [robot.index for robot in layout.factory.robots if robot.type == "six"]
    assert [does(layout, arm) for arm in arms] == [["c", "s", "s/taken", "p"], ["d", "p/2"]]
    made = run(layout, units=4, jitter=0.3, seed=3)
    assert made.succeeded and made.products == 4
    assert made.physics is not None and made.physics.unintended_contacts == 0


def test_a_carrier_waits_until_the_arm_has_gone_to_leave_for_its_tool() -> None:
    """And for its feeder, from where the arm has taken what it brought."""
    layout = post()
    assert layout.certificate is not None
    starts = {order.start for order in layout.certificate.apart.orders}
    assert starts == {"b_s", "p_s", "s_s"}
    passes = {past.after: past for past in layout.certificate.apart.passes}
    for label in ("q", "t"):
        join = layout.factory.by_label[label]
        legs = [leg for leg in chains(layout).curves.legs if not leg.brings]
        stop = layout.visits[join.index, 4].at
        (leg,) = [leg for leg in legs if leg.reach == pytest.approx(stop)]
        assert passes[join.end].at == pytest.approx(stop + leg.way.off + BEYOND, abs=1e-6)


def test_a_tour_that_begins_where_the_last_ended_turns_the_tool() -> None:
    """So the arm is never at one configuration at two places of a way."""
    layout = post()
    grips = chains(layout).grips
    assert np.allclose(grips["c"].tip[:2], grips["s/taken"].tip[:2])
    apart = abs(grips["c"].yaw - grips["s/taken"].yaw)
    assert apart % (np.pi / 4) == pytest.approx(np.pi / 8)
    row = chains(layout).row(layout.factory.by_label["s/taken"].index, 4)
    way = chains(layout).curves.legs[row].way
    q = way.at(np.linspace(0.0, way.length, 200))[0]
    assert np.linalg.norm(q - q[::-1], axis=1)[:90].min() > 0.1


def test_what_can_only_be_lowered_before_comes_before() -> None:
    """The block goes under the roof before that is on."""
    made = armed(plain(ROOF), six())
    order = [n.inputs[-1] for n in made.pag.nodes if n.operation == "place"]
    assert order == ["d", "s/taken", "c"]
    lowered = {label: a.lowered for label, a in made.approaches.items() if len(label) > 1}
    assert all(lowered.values())


def test_a_pile_on_rails_is_what_the_cell_makes_of_it() -> None:
    """Without what moves it only, and each place an insert."""
    made = armed(plain(POST), six())
    rails = on_rails(plain(POST), made.pag, "s/shown").pag
    assert rails.root == "s" and {n.label: n.operation for n in rails.nodes} == {
        "s": "press",
        "t": "insert",
        "b": "atomic",
        "c": "atomic",
    }
    whole = on_rails(plain(POST), made.pag, "p").pag
    assert {n.label for n in whole.nodes} == {"p", "q", "s", "t", "a", "b", "c"}


def test_a_sub_assembly_is_one_body() -> None:
    """Also where nobody asks for it; `--no-fuse` is refused."""
    simulation = Simulation(post(), RunRequest(units=1, shown=False))
    assert simulation.physical.m.body(names.part("t", 1)).subtreemass[0] > 0.0
    with pytest.raises(InputError) as error:
        RunOptions(units=1, fuse=False).request(project(POST, "six"))
    assert "each of these is one body" in error.value.diagnostics[0].message


def test_a_heavy_part_is_held_by_a_pin() -> None:
    heavy = POST.replace("0.0502), density = 1200", "0.0502), mass = 3")
    layout = project(heavy, "six").layout
    assert {label: grip.kind for label, grip in chains(layout).grips.items()}["c"] == "pin"
    from factory.floor.layout.hands.bores import bores

    (bore,) = [bore for bore in bores(layout) if bore.label == "c"]
    assert bore.robot == "r5" and bore.diameter == chains(layout).grips["c"].radius


@pytest.mark.slow
def test_eight_sub_assemblies_have_no_room() -> None:
    """`test_feeders_without_room_are_refused` has parts in their place."""
    parts, joins = [], []
    for n in range(8):
        x = 0.06 * n
        parts.append(f"b{n} = atomic ( box = (0.05, 0.05, 0.02), pos = ({x}, 0, 0.0301) )")
        parts.append(f"c{n} = atomic ( box = (0.03, 0.03, 0.02), pos = ({x}, 0, 0.0502) )")
        joins.append(f"s{n} = mate ( b{n}, c{n} )")
    base = "a = atomic ( box = (0.5, 0.06, 0.02), pos = (0.21, 0, 0.01) )"
    whole = f"p = mate ( a, {', '.join(f's{n}' for n in range(8))} )"
    why = refusal(";\n".join(["root = p", whole, *joins, base, *parts]))
    assert why.code in ("Layout", "Unreachable") and "rails" in why.hint


def test_a_line_without_room_says_how_much_is_missing() -> None:
    """Where a block with a drawer is built, beside a pedestal as wide as the cell."""
    text = """root = p;
p = mate ( a, s ); s = mate ( t, d ); t = mate ( b, c );
a = atomic ( box = (0.12, 0.1, 0.02), pos = (0, 0, 0.01) );
b = atomic ( box = (0.05, 0.06, 0.05), pos = (-0.025, 0, 0.0451) );
c = atomic ( box = (0.1, 0.06, 0.008), pos = (0, 0, 0.0743) );
d = atomic ( box = (0.045, 0.05, 0.03), pos = (0.0227, 0, 0.0501) )"""
    with patch.object(arrangement, "pedestal", lambda stand: (-9.0, 9.0, -9.0, 9.0)):
        why = refusal(text)
    assert why.code == "Layout" and why.position is not None and why.position.line == 2
    told = (
        r"the line of r2, on which 's' is built, has no room at its arm: it is (\d+) mm wide and"
        r" at best \d+ mm too near to the base of r3; the arm has its wrist beside it for 'd'"
    )
    wide = re.fullmatch(told, why.message)
    assert wide is not None and int(wide[1]) > 300, why.message
    assert why.hint.startswith("parts that are lowered")


def test_a_part_that_is_presented_turned_is_turned_back() -> None:
    """By the wrist, between where it is taken and where it is placed."""
    text = """root = p;
p = mate ( a, b );
a = atomic ( box = (0.09, 0.06, 0.02), pos = (0, 0, 0.01), density = 1200 );
b = atomic ( box = (0.05, 0.02, 0.02), pos = (0.01, 0, 0.0302), density = 1200, fed = 0.6 )"""
    layout = project(text, "six").layout
    table = chains(layout)
    row = table.row(layout.factory.by_label["p"].index, 1)
    leg = table.curves.legs[row]
    _, turns = leg.chain.tool(leg.way.at(np.array([0.0, leg.way.length]))[0])
    turned = turns[0] @ turns[1].T
    assert np.arctan2(turned[1, 0], turned[0, 0]) == pytest.approx(0.6, abs=1e-6)
    made = run(layout, units=2, jitter=0.3)
    assert made.succeeded and made.physics is not None
    assert made.physics.unintended_contacts == 0 and made.physics.product_error_max_mm < 0.01


def test_the_program_says_from_where_a_sub_assembly_is_taken() -> None:
    text = program_text(post(), 4, ())
    assert "  # take from r3: s/taken\n" in text and "  # fetch c\n" in text
    assert 'wait_carrier("r3", "s/taken")' in text and 'wait_part("s/taken")' not in text


def test_what_is_in_the_product_counts_where_a_part_is_placed() -> None:
    """A configuration that takes a link through what is there already is none."""
    asked, planned = list[set[str]](), planning.candidates

    def seen(scene: Scene, q: Array, label: str, need: float, spared: set[str]) -> object:
        asked.append({*scene.obstacles} - spared)
        return np.ones(len(q)), np.zeros(len(q), int)

    def tried(chain: object, takes: object, puts: object, clear: object, *more: object) -> object:
        with patch.object(Scene, "margins", seen):
            clear(np.zeros((1, 6)))  # type: ignore[operator]
        return planned(chain, takes, puts, clear, *more)  # type: ignore[arg-type]

    with patch.object(planning, "candidates", tried):
        assert project(SMALL, "six").layout.certificate
    motor, lid = asked
    assert "'tub' in the product" in motor and "'motor' in the product" not in motor
    assert {"'tub' in the product", "'motor' in the product"} <= {*lid}
    assert "'lid' in the product" not in lid and "the carrier" not in lid


def test_a_feeder_in_the_way_of_another_is_refused() -> None:
    """A pedestal as wide as the cell stands in every feeder."""
    with patch.object(obstacles, "pedestal", lambda stand: (-9.0, 9.0, -9.0, 9.0)):
        why = refusal(SMALL)
    assert why.code == "Layout" and "the post of 'tub' has no room" in why.message
