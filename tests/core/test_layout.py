"""The layout: what it says of the paper's example, of floors and payloads, and of what it builds.
What a hand costs, where pads and tips may be, and what is in their way."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import pytest

from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.geometry.common_places import Top, common_places
from factory.floor.geometry.product import product_geometry
from factory.floor.geometry.solids import Solid
from factory.floor.layout import nearness
from factory.floor.layout.certificate import ALWAYS, ARM_BODY, NAMES, Certificate, Region
from factory.floor.layout.clearance import certify
from factory.floor.layout.crowding import Crowding
from factory.floor.layout.dimensions import ARMS, SIDE, Clearance
from factory.floor.layout.embedding import lay_out
from factory.floor.layout.exclusions import coordinated
from factory.floor.layout.footprint import footprint
from factory.floor.layout.hands import in_the_way
from factory.floor.layout.hands.choosing import Hands
from factory.floor.layout.hands.groups import LONG, PINNED, WAIT
from factory.floor.layout.hands.hand import Hand
from factory.floor.layout.hands.holding import held
from factory.floor.layout.hands.kinds import ABOVE, BELOW
from factory.floor.layout.hands.lowered import Lowered
from factory.floor.layout.hands.one_hand import _cost
from factory.floor.layout.hands.outermost import _on_edges
from factory.floor.layout.hands.places import Loads, places
from factory.floor.layout.hands.surfaces import hit
from factory.floor.layout.layout import Layout
from factory.floor.layout.machines import presences
from factory.floor.layout.nearness import Near, distances, meeting, near
from factory.floor.layout.outline import Choice, Guest, outlined
from factory.floor.layout.presence import ACROSS
from factory.floor.layout.shapes import symmetric_shapes
from factory.support.errors import InputError
from factory.theory.compiler.compiler import compile_pag
from factory.theory.lang.pag_reader import read_pag
from factory.theory.lang.template_reader import all_templates
from factory.theory.nets.coordinated import Coordination
from factory.theory.problem.template import Law, Point
from tests.examples import with_hands
from tests.layout_values import (
    DRAWN,
    STYLES,
    Drawn,
    paper_layout,
    random_layout,
    row_of_inserts,
    shortened,
    table_pag,
    with_path,
    with_visits,
)
from tests.pag_values import SHAPES, TEMPLATES, catalogue, paper
from tests.slow import slow_but


def test_the_same_input_gives_the_same_layout() -> None:
    anew = random_layout.__wrapped__
    first, second = (anew(30, 4, "any", "mixed") for _ in range(2))
    assert first.guidepaths == second.guidepaths and first.visits == second.visits


def test_stretching_changes_lengths_alone() -> None:
    """A larger clearance makes paths longer; nothing else is scaled."""
    near, far = (lay_out(paper_layout().factory, paper_layout().product, c) for c in (0.01, 0.04))
    assert near.guidepath_length < paper_layout().guidepath_length < far.guidepath_length
    assert [p.heading for p in near.guidepaths] == [p.heading for p in far.guidepaths]


def test_three_guests_at_one_point_are_refused() -> None:
    clamp = TEMPLATES["clamp"]
    press = replace(
        clamp,
        robots=("dot", "tool", "tool", "tool"),
        before=(*clamp.before, "nopart"),
        after=(*clamp.after, "nopart"),
        law=Law("navigation", (*clamp.law.goals, Point("A", 4, 2))),
    )
    with pytest.raises(InputError, match="3 guidepaths would end at one point"):
        laid_out_with(press)


def test_a_guest_with_its_goal_away_from_a_is_refused() -> None:
    weld = TEMPLATES["weld"]
    law = replace(weld.law, goals=(weld.law.goals[0], Point("B", 2)))
    with pytest.raises(InputError, match="'sub2': a robot that is not the carrier has its goal"):
        laid_out_with(replace(weld, law=law))


def laid_out_with(template: object) -> Layout:
    """The paper's example with one template replaced, under its own name or as weld."""
    name = template.name if template.name in ("mate", "weld") else "weld"  # type: ignore[attr-defined]
    templates = {**TEMPLATES, name: replace(template, name=name)}  # type: ignore[type-var]
    factory = compile_pag(paper(), templates, catalogue())  # type: ignore[arg-type]
    return lay_out(factory, product_geometry(factory.pag))


NOTHING = np.full(2, np.inf), np.full(2, -np.inf)


def solids(shapes: list[tuple[str, float, float]]) -> list[Solid]:
    """Parts of these shapes at these places in plan."""
    names = [f"p{n}" for n in range(len(shapes))]
    parts = (
        f"{name} = atomic ( {shape}, pos = ( {x}, {y}, 0 ) );"
        for name, (shape, x, y) in zip(names, shapes, strict=True)
    )
    text = f"root = s; s = mate ( {', '.join(names)} ); {' '.join(parts)}"
    product = product_geometry(read_pag(text, all_templates()))
    return [product.solids[name] for name in names]


def test_needles_nearer_than_pads_can_be_have_none() -> None:
    needle = "box = ( 0.0002, 0.0002, 0.02 )"
    parts = solids([(needle, 0.0, 0.0), (needle, 0.0003, 0.0)])
    assert common_places([Top.of(part, np.zeros(2)) for part in parts], NOTHING) == []


def test_an_order_with_its_tokens_exchanged_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    layout = with_hands("truck")
    assert certify(layout).holds
    order: Callable[..., None] = Coordination.order

    def exchanged(self: Coordination, place: str, past: Any, start: int, tokens: int) -> None:
        order(self, place, past, start, 0)

    monkeypatch.setattr(Coordination, "order", exchanged)
    fault, *_ = (f for f in certify(layout).faults if "for ever" in f.message)
    assert "order:" in fault.message


mujoco = pytest.importorskip("mujoco")


def laid_out(seed: int) -> Layout:
    """A layout of another shape and style for each seed."""
    shape, style = SHAPES[seed % len(SHAPES)], STYLES[seed % len(STYLES)]
    return random_layout(7 + seed, seed, shape, style, True)


@pytest.mark.parametrize("number", slow_but([0, 3], range(8)))
def test_nothing_touches(number: int) -> None:
    """Two or three units, every robot with a speed and a gain of its own."""
    layout = laid_out(number)
    run = Simulation(
        layout, RunRequest("mujoco", units=2 + number % 2, seed=number, jitter=0.3)
    ).run()
    assert run.trouble is None, str(run.trouble)
    assert run.refines_net
    assert run.physics is not None
    assert run.physics.unintended_contacts == 0, run.physics.contacts


def test_layers_are_those_of_the_bodies() -> None:
    certificate = laid_out(0).certificate
    assert certificate is not None
    assert tuple(name for name, _, _ in certificate.layers) == NAMES


def broken(layout: Layout, *words: str) -> Certificate:
    """The certificate of a faulty layout, one of whose faults says all the words."""
    found = certify(layout)
    assert not found.holds
    texts = [fault.message for fault in found.faults]
    assert any(all(word in text for word in words) for text in texts), texts
    return found


SMALL = [drawn for drawn in DRAWN if drawn[0] <= 3]


@pytest.mark.parametrize(
    "drawn",
    [*SMALL, *(pytest.param(d, marks=pytest.mark.slow) for d in DRAWN if d not in SMALL)],
    ids=str,
)
def test_every_layout_is_clear(drawn: Drawn) -> None:
    layout = random_layout(*drawn)
    assert layout.certificate is not None and layout.certificate.holds
    assert certify(layout) == layout.certificate


def test_what_comes_near_in_the_paper_s_example_is_in_one_gear() -> None:
    found = paper_layout().certificate
    assert found is not None and not found.apart.orders
    met = {frozenset(pair.machines) for pair in found.apart.excluded}
    assert {frozenset(["r3", "r5"]), frozenset(["r3", "r6"]), frozenset(["r1", "r2"])} <= met


def test_layers_and_gaps_are_stated() -> None:
    found = paper_layout().certificate
    assert found is not None
    assert [name for name, _, _ in found.layers] == ["carriages", "masts and arms", "payloads"]
    assert all(low < high for _, low, high in found.layers)
    assert all(gap > 0 for _, gap in found.gaps)


def test_coupled_regions_belong_to_the_operation_that_takes_the_payload() -> None:
    layout = paper_layout()
    assert layout.certificate is not None
    coupled = [r for r in layout.certificate.regions if r.mode != ALWAYS]
    assert len(coupled) == 5  # every robot but the tool delivers once
    for region in coupled:
        operation = layout.factory.operations[region.mode]
        assert region.label in operation.before


def test_a_fault_says_where_and_by_how_much() -> None:
    found = certify(shortened(paper_layout(), 4, 0.012))
    fault = next(fault for fault in found.faults if set(fault.robots) == {"r5", "r3"})
    assert fault.lacking == pytest.approx(0.012, abs=0.0015 + SIDE)
    assert len(fault.positions) == 2
    diagnostic = fault.diagnostic()
    assert diagnostic.code == "Layout"
    assert "mm nearer than they may; making a single unit needs both at once" in diagnostic.message
    assert "test.pag" in diagnostic.hint
    assert json.dumps(found.as_json())


def test_an_insertion_with_a_wrong_standoff(monkeypatch: pytest.MonkeyPatch) -> None:
    layout = row_of_inserts()
    monkeypatch.setattr(Layout, "standoff", lambda self, operation, slot: 0.0)
    broken(layout, "mm nearer than they may at the end of")
    monkeypatch.setattr(Layout, "standoff", lambda self, operation, slot: 2.0)
    broken(layout, "it could never start")


def test_a_station_moved_onto_its_neighbour() -> None:
    layout = row_of_inserts()
    factory = layout.factory
    inserts = [o for o in factory.operations if o.template.name == "insert"]
    later, sooner = inserts[0], inserts[2]
    station = layout.guidepaths[sooner.carrier].length - layout.station(sooner.index)
    moved = with_visits(layout, {later.index: station})
    broken(moved, "away from the junction", later.label)
    guest = later.robots[1]
    on = layout.guidepaths[later.carrier]
    both = with_path(moved, guest, a=on.middle(on.length - station))
    neighbour = factory.robots[sooner.robots[1]].name
    broken(both, factory.robots[guest].name, neighbour, "cross")


def test_guidepaths_that_cross_or_leave_the_grid() -> None:
    layout = paper_layout()
    x, y = layout.guidepaths[5].a
    broken(with_path(layout, 5, a=(x + 0.0004, y)), "r6", "not in whole millimetres")
    broken(with_path(layout, 5, travel=0.0), "r6", "has no length")
    broken(with_path(layout, 5, a=(x - 0.2, y)), "the guidepaths of r5 and r6 cross at")
    across = with_path(layout, 3, travel=-0.4)
    broken(across, "the guidepaths of r3 and r4 cross at")


def test_a_fault_of_two_regions_says_how_far_they_are_apart_or_in_each_other() -> None:
    layout = paper_layout()
    one = Region(1, ARMS, ARM_BODY, (0.0, 1.0, 0.0, 1.0), (0.0, 0.1))
    for x, said in ((1.003, "are 3.0 mm apart"), (0.998, "overlap by 2.0 mm")):
        other = replace(one, robot=2, box=(x, 2.0, 0.0, 1.0))
        assert said in Crowding(layout).fault(one, other).message


def test_a_floor_has_tiles_only_if_they_are_asked_for() -> None:
    assert paper_layout().tile == 0.0


def test_a_corridor_beside_a_robot_is_left_only_if_it_is_asked_for() -> None:
    layout = paper_layout()
    (shape, *_), c = symmetric_shapes(layout.factory, layout.payloads, Clearance()), Clearance()
    made = [footprint(layout.factory, 0, shape, c, *asked) for asked in ((), (False,), (True,))]
    assert [one.corridor for one in made] == [False, False, True]


def test_guests_are_seen_apart_unless_they_are_to_be_one_box() -> None:
    layout = paper_layout()
    shape, *_ = symmetric_shapes(layout.factory, layout.payloads, Clearance())
    own = footprint(layout.factory, 0, shape, Clearance())
    piles = [own.placed(own.stops[0], 0.0, {}, ())]
    alone = outlined(own, piles, (), Choice())
    guests = [Guest(n, alone, side, 0.2) for n, side in enumerate((-1, 1))]
    apart, box = (
        outlined(own, piles, guests, Choice()),
        outlined(own, piles, guests, Choice(), True),
    )
    assert [len(blocks) for blocks in apart.blocks] == [3, 3, 3]
    assert [len(blocks) for blocks in box.blocks] == [1, 1, 1]


def test_layers_keep_apart_unless_one_bears_what_it_hands_over() -> None:
    layout = paper_layout()
    sides = list(presences(layout, coordinated(layout), {}))
    pairs = [(one, other) for one, other in combinations(sides, 2) if one.is_apart(other)]
    found = {(a.bears or b.bears, distances(a, b, 0.02)[2]) for a, b in pairs}
    assert found == {(False, ACROSS), (True, 0.0)}


def test_boxes_are_compared_alike_in_blocks_of_any_size(monkeypatch: pytest.MonkeyPatch) -> None:
    layout, apart = paper_layout(), 0.2
    sides = list(presences(layout, coordinated(layout), {}))

    def compared() -> tuple[list[Near], list[list[list[float]]]]:
        pairs = [(one, other) for one, other in combinations(sides, 2) if one.is_apart(other)]
        met = [meeting(one, other, (apart, apart, apart)) for one, other in pairs]
        return [*near(sides, apart)], [[rows.tolist() for rows in each] for each in met]

    at_once = compared()
    assert at_once[0] and any(len(need) > 9 for need, *_ in at_once[1])
    monkeypatch.setattr(nearness, "BLOCK", 3)
    in_blocks = compared()
    assert in_blocks[1] == at_once[1]
    assert Counter(map(_close, in_blocks[0])) == Counter(map(_close, at_once[0]))


def _close(pair: Near) -> tuple[object, ...]:
    return pair.one.name(0), pair.other.name(0), pair.bodies, pair.lacking


def test_a_pin_and_a_wait_cost_and_a_wait_no_more_than_a_long_one() -> None:
    hand = Hand(BELOW, ((0.0, 0.0, 0.0),))
    waits = replace(hand, wait=0.1 * LONG / WAIT)
    late = replace(hand, wait=9.0 * LONG / WAIT)
    assert _cost(hand) == 0.0
    assert _cost(replace(waits, tip="pin")) == pytest.approx(PINNED + 0.1 * LONG)
    assert _cost(late) == LONG


def test_an_upright_edge_is_within_a_disc_where_its_foot_is() -> None:
    """And one that rises reaches as far out as where it leaves the disc."""
    ends = np.array([[[0.05, 0.0], [0.05, 0.0]], [[0.0, 0.0], [0.1, 0.0]]])
    out, at = np.array([[0.0, 0.3], [0.0, 0.2]]), np.array([[0.0, 0.0], [0.05, 0.0], [0.0, 0.9]])
    reach = _on_edges(ends, out, at, np.full(3, 0.01))
    assert reach == pytest.approx([0.02, 0.3, -np.inf])


def test_how_thick_a_plate_is_does_not_matter_to_places_on_it() -> None:
    made = []
    for thick in (0.005, 0.1):
        values = {"box": (0.1, 0.06, thick), "density": 5.0 / thick}
        product = product_geometry(table_pag("x", ("x", "atomic", "", values)))
        made.append(places(product, ("x",), (2, 1), ABOVE, Loads.of(product, (("x",),), 0.0)))
    thin, thick = made
    assert len(thin) and (thin.at[:, :2] == thick.at[:, :2]).all()


def test_what_is_lowered_onto_a_place_is_in_the_way_there(monkeypatch: pytest.MonkeyPatch) -> None:
    layout = paper_layout()
    looked = Hands(layout.factory, layout.product).in_the_way
    frames = [((1, 0), (0, 1))]
    robot = next(r.index for r in layout.factory.robots if r.travels and r.index)
    label = held(layout.factory, robot)
    at = looked.on_side(robot, ABOVE, frames)

    def met(*ways: Any) -> Any:
        return np.arange(ways[0]) == 0 if len(ways) == 1 else hit(*ways)

    monkeypatch.setattr(Lowered, "beams", lambda _, robot, kind, at, u, t: [(len(at),)])
    monkeypatch.setattr(in_the_way, "hit", met)
    free, _ = looked.checks(robot, label, ABOVE, at, frames)
    assert free["lowered"].tolist() == [False, *[True] * (len(at) - 1)]
