"""No two machines ever meet: by a checker that knows the MJCF, the ways and the circuits alone; and
faults that are planted are refused by it, by name."""

from __future__ import annotations

import random
from copy import deepcopy
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from factory.apps.exports import stock
from factory.apps.exports.ways import ways
from factory.engine.mjcf.loading import load
from factory.engine.mjcf.model import build_model
from factory.engine.simulation.ordering import Ordering
from factory.floor.layout import nearness
from factory.floor.layout.clearance import certify
from factory.floor.layout.coordinating import with_machines
from factory.floor.layout.exclusions import awaited_positions, coordinated, exclusions
from factory.floor.layout.layout import Layout
from factory.floor.layout.machines import presences
from factory.floor.layout.presence import Presence
from factory.floor.mating.depth import exact
from factory.pipeline import read
from factory.support.errors import RunError
from factory.support.settings import Settings
from factory.theory.nets.coordinated import Order, Past
from factory.theory.problem.robot_types import load_catalogue
from tests.clearance_values import check
from tests.random_products import random_product

Json = dict[str, Any]

ORDER = "order:past:r8:2:s1/5:s1/4"
"""What a carrier waits for with its next unit: a hand that has gone from its station."""

SEEDS = (39014, 39018)
"""Random products: a fetch that a carrier waits for; lifts."""


@cache
def laid_out(seed: int) -> Layout:
    """A random product, laid out; the paper's for 0."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "product.pag"
        file.write_text(random_product(seed))
        return read(file if seed else "examples/paper.pag").layout


@cache
def _written(seed: int) -> tuple[mujoco.MjModel, Json, Json]:
    layout = laid_out(seed)
    copies = {leaf.label: 1 for leaf in layout.factory.leaves}
    model = stock.written(build_model(layout, load_catalogue(), copies, Settings(timestep=0.002)))
    assert layout.certificate is not None
    return load(model), ways(model), layout.certificate.as_json()


def written(seed: int) -> tuple[mujoco.MjModel, Json, Json]:
    """What `build` writes of a product, to be changed."""
    m, machines, clearance = _written(seed)
    return m, deepcopy(machines), deepcopy(clearance)


def refused(faults: list[str], *words: str) -> None:
    """Some fault says all the words."""
    assert any(all(word in fault for word in words) for fault in faults), faults


@pytest.mark.parametrize("seed", [0, *SEEDS])
def test_what_comes_near_has_its_circuit(seed: int) -> None:
    m, machines, clearance = written(seed)
    assert clearance["excluded"]
    assert check(m, machines, clearance) == []


def test_a_wait_that_is_taken_out_is_refused() -> None:
    m, machines, clearance = written(39014)
    gone = next(row for row in machines["places"] if row["place"] == ORDER)
    machines["places"].remove(gone)
    refused(check(m, machines, clearance), "r1 and r8", "not of the net", ORDER)


def test_exchanged_tokens_are_refused() -> None:
    m, machines, clearance = written(39014)
    one, other = (
        next(row for row in machines["places"] if row["place"] == name) for name in (ORDER, "p3")
    )
    one["tokens"], other["tokens"] = other["tokens"], one["tokens"]
    refused(check(m, machines, clearance), "r1 and r8", "tokens", ORDER)


@pytest.mark.parametrize(("geom", "axis"), [("r2/column", 2), ("r5/bar", 0), ("r6/stem", 2)])
def test_a_hand_that_is_3_mm_longer_is_refused(geom: str, axis: int) -> None:
    m, machines, clearance = written(39014)
    number = m.geom(geom).id
    m.geom_aabb[number, 3 + axis] += 0.003
    try:
        refused(check(m, machines, clearance), geom, "no circuit")
    finally:
        m.geom_aabb[number, 3 + axis] -= 0.003


def test_a_magazine_that_is_10_mm_lower_is_refused() -> None:
    m, machines, clearance = written(39014)
    number = m.geom("feeder/p3/pad").id
    m.geom_pos[number, 2] -= 0.01
    try:
        refused(check(m, machines, clearance), "feeder/p3/pad", "r9", "no circuit")
    finally:
        m.geom_pos[number, 2] += 0.01


@pytest.mark.parametrize("name", ["r9", "r1"])
def test_a_post_in_the_way_is_refused(name: str) -> None:
    m, machines, clearance = written(39014)
    number, feeder, turned = m.geom("feeder/p3/post").id, m.body("feeder/p3"), np.zeros(3)
    before = m.geom_pos[number].copy()
    mujoco.mju_rotVecQuat(
        turned, m.body(f"{name}/carriage").pos - feeder.pos, feeder.quat * [1, -1, -1, -1]
    )
    m.geom_pos[number, :2] = turned[:2]
    try:
        refused(check(m, machines, clearance), f"{name}/", "near feeder/p3/post, which stands")
    finally:
        m.geom_pos[number] = before


def test_a_clear_point_that_is_5_mm_short_is_refused() -> None:
    m, machines, clearance = written(39014)
    beyond = [
        w for w in machines["ways"] if any("past:r9:" in p and " on" in p for p in w["places"])
    ]
    assert beyond
    for way in beyond:
        for span in way["spans"]:
            span[0][1] += 0.005
    refused(check(m, machines, clearance), "r9/pad", "magazine down:p3", "no circuit")


def test_what_a_unit_made_alone_needs_at_once_is_refused() -> None:
    """The guidepath of r3 is moved to where r1 begins."""
    paths = [*laid_out(0).guidepaths]
    x, y = paths[2].a
    paths[2] = replace(paths[2], a=(x, y + 0.1))
    moved = replace(laid_out(0), guidepaths=tuple(paths), certificate=None)
    faults = [fault.message for fault in exclusions(moved).faults]
    refused(faults, "carriage of r2, in sub3", "of r3, in sub3,", "needs both at once")


# --- presences ------------------------------------------------------------------------------------


def test_pairs_that_are_alike_are_judged_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the same answer as each by itself, and as by all facets where faces tell enough."""
    layout, clearance = read("examples/peg.pag").layout, 0.05
    net, back, judge = coordinated(layout), awaited_positions(layout), nearness.Nearness(clearance)
    pairs = [*nearness.near([*presences(layout, net, back)], clearance)]
    judged = [judge.nearer(pair) for pair in pairs]
    assert any(judged) and not all(judged)
    monkeypatch.setattr(nearness, "rough", exact)
    assert judged == [nearness.Nearness(clearance).nearer(pair) for pair in pairs]
    monkeypatch.setattr(nearness, "spanned", None)
    again = [*presences(layout, net, back)]
    for pair in nearness.near(again, clearance):
        judge.nearer(pair)
    moved = [replace(one, bodies=one.bodies.moved(np.full(3, 1e-4))) for one in again]
    with pytest.raises(TypeError):
        for pair in nearness.near(moved, clearance):
            judge.nearer(pair)


def marked_at_random(layout: Layout, steps: int, seed: int) -> set[int]:
    """The places that are marked after so many firings of a coordinated net."""
    net, rng = coordinated(layout).net, random.Random(seed)
    tokens = list(net.tokens)
    for _ in range(steps):
        presets = enumerate(net.net.preset)
        event = rng.choice([e for e, preset in presets if all(tokens[p] for p in preset)])
        for place in net.net.preset[event]:
            tokens[place] -= 1
        for place in net.net.postset[event]:
            tokens[place] += 1
    return {place for place, count in enumerate(tokens) if count}


@pytest.mark.parametrize("seed", [0, *SEEDS])
def test_machines_are_apart_in_every_marking(seed: int) -> None:
    """In markings that the net comes to, each machine somewhere; robots of one mode are kept apart
    by its field, and what a magazine does before long before by its speed."""
    layout = laid_out(seed)
    assert layout.certificate is not None
    apart = layout.certificate.apart
    net = with_machines(layout, apart.passes, apart.orders)
    found = [*presences(layout, net, awaited_positions(layout))]
    for number in range(60):
        marked = marked_at_random(layout, 40 + 17 * number, number)
        here = [one for one in found if {*one.places} <= marked]
        for n, one in enumerate(here):
            for other in here[n + 1 :]:
                if one.machine != other.machine and {*one.places}.isdisjoint(other.places):
                    assert not meet(one, other), (one.machine, other.machine)


def meet(one: Presence, other: Presence) -> bool:
    """Whether boxes of two presences overlap, but for magazines, whose orders no run keeps."""
    if one.bears or other.bears:
        return False
    a, b = one.boxes[:, None], other.boxes[None]
    apart = np.maximum(a[:, :, 0] - b[:, :, 1], b[:, :, 0] - a[:, :, 1]).max(axis=2)
    return bool(apart.min() < -1e-5)


# --- the certificate ------------------------------------------------------------------------------


def test_robots_go_back_by_themselves_for_what_waits_for_that() -> None:
    """To where their certificate says; the same is found where there is none."""
    layout = laid_out(39014)
    back = awaited_positions(layout)
    assert back and layout.certificate is not None
    assert awaited_positions(replace(layout, certificate=None)) == back
    robot = next(iter(back))
    apart = replace(layout.certificate.apart, backs=((robot, back[robot] + 0.01),))
    told = replace(layout.certificate, apart=apart)
    assert awaited_positions(replace(layout, certificate=told)) == {robot: back[robot] + 0.01}


def test_what_no_order_keeps_apart_is_a_fault() -> None:
    """A hand that stands in what its carrier holds when it has delivered."""
    layout = read("examples/paper.pag").layout
    hands = list(layout.hands)
    hand = hands[1]
    assert hand is not None
    x, y, z = hand.places[0]
    hands[1] = replace(hand, places=((x, y, z + 0.01),))
    found = certify(replace(layout, hands=tuple(hands), certificate=None))
    assert not found.holds
    fault = next(f for f in found.faults if "both at once" in f.message)
    assert {*fault.robots} == {"r1", "r2"} and fault.lacking > 0.008
    assert fault.diagnostic().code == "Layout"


def test_hands_that_collide_where_an_operation_ends_are_a_fault(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """What is lowered comes down through a beam, where hands are chosen as if that were a pin."""
    file = tmp_path / "product.pag"
    file.write_text(random_product(2611270266))
    narrow = "factory.floor.layout.hands.in_the_way.under_beam"
    monkeypatch.setattr(narrow, lambda kind, low, high, radius: (low, high))
    with pytest.raises(RunError, match=r"beam of r6 and p15 of r7 .* at the end of 's16'"):
        _ = read(file).layout


def test_a_product_is_the_same_with_its_certificate() -> None:
    """The certificate of a layout that has one is the same."""
    for seed in (0, *SEEDS):
        assert certify(laid_out(seed)) == laid_out(seed).certificate


# --- order places in a run ------------------------------------------------------------------------


def test_an_order_after_a_pass_waits_for_what_the_pass_follows() -> None:
    """The pass of another machine may be of its last round: the transition that it follows has to
    have fired in this one."""
    fired = {3: 0, 5: 0, 4: 1}
    ordering = Ordering([Order(3, 4, 1, Past(3, 0, 0.2), 5, 0)])
    assert ordering.hold_up(4, fired.__getitem__, lambda: np.array([0.3]))
    fired[3] = 1
    assert not ordering.hold_up(4, fired.__getitem__, lambda: np.array([0.3]))
    ordering.ask_anew()
    assert ordering.hold_up(4, fired.__getitem__, lambda: np.array([0.1]))


def test_an_operation_waits_for_another() -> None:
    fired = [0] * 6
    ordering = Ordering([Order(3, 4, 0)])

    def waits() -> bool:
        return ordering.hold_up(4, fired.__getitem__, lambda: np.zeros(1))

    assert waits() and ordering.lacking == {3}
    fired[3] = 1
    ordering.ask_anew()
    assert not waits() and not ordering.lacking
    fired[4] = 1
    assert waits()
    ordering.keep_passes()
    assert not waits()
