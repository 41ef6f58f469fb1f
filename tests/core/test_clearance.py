"""The clearance certificate: it holds for every layout, and fails for every planted fault."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations, product

import numpy as np
import pytest

from factory.floor.layout.certificate import ALWAYS, PAYLOAD_BODY, Certificate, Region
from factory.floor.layout.clearance import certify
from factory.floor.layout.coordinating import with_machines
from factory.floor.layout.crossings import touching
from factory.floor.layout.crowding import Crowding, separation
from factory.floor.layout.dimensions import PAYLOADS, SIDE
from factory.floor.layout.layout import Layout
from factory.floor.layout.machines import presences
from factory.floor.layout.nearness import near
from factory.floor.layout.presence import ACROSS, ALONG, ANY, Presence
from tests.layout_values import (
    DRAWN,
    Drawn,
    grown,
    many_layouts,
    paper_layout,
    random_layout,
    robots_with_payload,
    row_of_inserts,
    shortened,
    stations_of,
    with_path,
    with_visits,
)
from tests.pag_values import SHAPES


def broken(layout: Layout, *words: str) -> Certificate:
    """The certificate of a faulty layout, one of whose faults says all the words."""
    found = certify(layout)
    assert not found.holds
    texts = [fault.message for fault in found.faults]
    assert any(all(word in text for word in words) for text in texts), texts
    return found


# --- it holds -------------------------------------------------------------------------------------


@pytest.mark.parametrize("drawn", DRAWN, ids=str)
def test_every_layout_is_clear(drawn: Drawn) -> None:
    layout = random_layout(*drawn)
    assert layout.certificate is not None and layout.certificate.holds
    assert certify(layout) == layout.certificate


@pytest.mark.parametrize("clearance", [0.001, 0.005, 0.0125, 0.05, 0.2])
def test_any_clearance_can_be_had(clearance: float) -> None:
    from factory.floor.layout.embedding import lay_out

    for layout in (paper_layout(), random_layout(20, 3, "any", "mixed")):
        again = lay_out(layout.factory, layout.product, clearance)
        assert again.certificate is not None and again.certificate.holds
        assert again.certificate.clearance == clearance


@pytest.mark.parametrize("drawn", DRAWN[1::3], ids=str)
def test_looking_at_every_pair_finds_the_same(drawn: Drawn) -> None:
    """All bodies of all machines, compared one by one."""
    layout = random_layout(*drawn)
    for changed in (layout, shortened(layout, 0, 0.03), with_path(layout, 0, arm=-0.3)):
        every = [*presences(changed, with_machines(changed, ()), {})]
        sizes = np.array([len(one.boxes) for one in every])
        if sizes.sum() > 700:
            continue
        pairs = {frozenset([id(p.one), id(p.other)]) for p in near(every, changed.clearance)}
        assert pairs == {*every_pair(every, changed.clearance)}


def every_pair(every: list[Presence], clearance: float) -> Iterator[frozenset[int]]:
    """The pairs of presences that come near: by less than the clearance in one layer, unless one
    takes what the other holds."""
    for one, other in combinations(every, 2):
        if one.machine == other.machine:
            continue
        mode = not {*one.places}.isdisjoint(other.places)
        works = not one.partners.isdisjoint(other.partners)
        empty = not (one.label and other.label) or one.bears or other.bears
        bodies = (zip(each.boxes, each.layers, strict=True) for each in (one, other))
        for (a, i), (b, j) in product(*bodies):
            gap = np.maximum(a[0] - b[1], b[0] - a[1]).max()
            alike, loads = i == j or ANY in (i, j), PAYLOADS in (i, j)
            needed = clearance - 2 * ALONG if alike else 0.0 if one.bears or other.bears else ACROSS
            if alike and loads and works and empty:
                needed = 0.0 if one.bears or other.bears else ACROSS
            if gap < needed - 3e-6 and not (mode and (loads or not alike)):
                yield frozenset([id(one), id(other)])
                break


def test_boxes_are_as_far_apart_as_their_corners() -> None:
    assert separation((0, 1, 0, 1), (4, 6, 5, 6)) == separation((4, 6, 5, 6), (0, 1, 0, 1)) == 5


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


# --- planted faults -------------------------------------------------------------------------------


def test_a_guidepath_shortened_by_30_mm() -> None:
    layout = paper_layout()
    for robot in robots_with_payload(layout):
        name = layout.factory.robots[robot].name
        found = certify(shortened(layout, robot, 0.03))
        assert not found.holds and found.faults[0].lacking > 0, name
    alone = with_path(layout, 2, travel=layout.guidepaths[2].travel - 0.03)
    broken(alone, "r3 stands 30.0 mm beyond the end of its guidepath")
    alone = with_visits(alone, stations_of(layout))
    broken(alone, "ends 30.0 mm away from the junction of 'sub1' on r3's guidepath")


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


def test_a_mirrored_side() -> None:
    layout = random_layout(16, 8, "balanced", "far")
    for robot in range(1, len(layout.guidepaths)):
        path = layout.guidepaths[robot]
        mirrored = with_path(layout, robot, side=(-path.side[0], -path.side[1]))
        broken(mirrored, layout.factory.robots[robot].name, "it is mirrored")
    paper = paper_layout()
    wrong_way = (-paper.guidepaths[4].heading[0], -paper.guidepaths[4].heading[1])
    broken(with_path(paper, 4, heading=wrong_way), "of r5", "of r6", "nearer than they may")
    broken(with_path(layout, 1, heading=layout.guidepaths[1].side), "no axes at right angles")


def test_arms_past_the_rim() -> None:
    """Those of robots that stay where they work; one that goes home first is waited for."""
    layout = paper_layout()
    for robot in (1, 3, 4, 5):
        past = layout.guidepaths[robot].arm - 0.03
        name = layout.factory.robots[robot].name
        if robot == 1:
            orders = certify(with_path(layout, robot, arm=past)).apart.orders
            assert [(order.before, order.start) for order in orders] == [
                ("past:r2:2:sub3", "dropoff_s"),
                ("past:r1:1:dropoff", "sub3_s"),
            ]
            continue
        broken(with_path(layout, robot, arm=past), f"arm of {name}")


def test_a_larger_payload_than_the_layout_knew() -> None:
    layout = paper_layout()
    for part in ("part1", "part2", "part3"):
        for by in (0.002, 0.05):
            found = certify(grown(layout, part, by))
            assert not found.holds
            assert any(f"{part} of r" in fault.message for fault in found.faults)


def test_a_post_in_the_way() -> None:
    """A layout that takes a part for longer puts its post farther back, some day where another
    is."""
    layout, far = random_layout(15, 2, "balanced", "medium"), 0.6
    found = set()
    for leaf in layout.factory.leaves:
        xlo, xhi, ylo, yhi = layout.payloads[leaf.label]
        longer = (xlo - far, xhi + far, ylo - far, yhi + far)
        payloads = {**layout.payloads, leaf.label: longer}
        for fault in certify(replace(layout, payloads=payloads, certificate=None)).faults:
            name = layout.factory.robots[leaf.carrier].name
            if f"post of feeder of {name}," in fault.message:
                found.add(leaf.label)
                assert name in fault.robots
    assert len(found) >= 3


def test_the_outfeed_in_the_way() -> None:
    layout = paper_layout()
    xlo, xhi, ylo, yhi = layout.outfeed
    longer = replace(layout, outfeed=(xlo - 0.01, xhi, ylo, yhi), certificate=None)
    broken(longer, "part3 of r2, in sub3", "belt of outfeed, which stands")


def test_an_insertion_with_a_wrong_standoff(monkeypatch: pytest.MonkeyPatch) -> None:
    layout = row_of_inserts()
    monkeypatch.setattr(Layout, "standoff", lambda self, operation, slot: 0.0)
    broken(layout, "mm nearer than they may at the end of")
    monkeypatch.setattr(Layout, "standoff", lambda self, operation, slot: 2.0)
    broken(layout, "it could never start")


def test_guidepaths_that_cross_or_leave_the_grid() -> None:
    layout = paper_layout()
    x, y = layout.guidepaths[5].a
    broken(with_path(layout, 5, a=(x + 0.0004, y)), "r6", "not in whole millimetres")
    broken(with_path(layout, 5, travel=0.0), "r6", "has no length")
    broken(with_path(layout, 5, a=(x - 0.2, y)), "the guidepaths of r5 and r6 cross at")
    across = with_path(layout, 3, travel=-0.4)
    broken(across, "the guidepaths of r3 and r4 cross at")


def test_boxes_that_touch_are_found_chunk_by_chunk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("factory.floor.layout.crossings.CHUNK", 7)
    rng = np.random.default_rng(1)
    low = rng.integers(0, 40, (50, 2))
    high = low + rng.integers(0, 12, (50, 2))
    pairs = [
        (i, j)
        for i, j in combinations(range(50), 2)
        if (low[i] <= high[j]).all() and (low[j] <= high[i]).all()
    ]
    assert list(touching(low, high)) == pairs


def test_faults_are_listed_up_to_a_limit() -> None:
    layout = random_layout(60, 1, "balanced", "medium")
    heap = tuple(replace(path, a=(0.0, 0.0)) for path in layout.guidepaths)
    found = certify(replace(layout, guidepaths=heap, certificate=None))
    assert 0 < len(found.faults) <= 100


# --- as short as clearance allows, and in linear time --------------------------------------------


def test_most_guidepaths_cannot_be_5_mm_shorter() -> None:
    """A robot keeps the width of its feeder's housing free all along its path: 2 mm a side."""
    tight = total = 0
    for layout in (paper_layout(), row_of_inserts(6), *many_layouts(14, range(4))):
        for robot in robots_with_payload(layout):
            total += 1
            tight += not certify(shortened(layout, robot, 0.001 + 2 * SIDE)).holds
    assert tight >= 0.75 * total, f"{tight} of {total}"


def test_work_grows_with_the_number_of_robots() -> None:
    for shape in SHAPES:
        small, large = (random_layout(n, 1, shape, "plain") for n in (10, 30))
        robots = len(large.guidepaths) / len(small.guidepaths)
        many, few = ([*presences(one, with_machines(one, ()), {})] for one in (large, small))
        assert len(many) <= 1.3 * robots * len(few)


def test_only_what_one_robot_brings_together_is_not_crowded() -> None:
    """Two payloads in one place: of robots in one mode, or of unrelated ones."""
    layout = paper_layout()
    mate, alone = (layout.factory.by_label[label].index for label in ("sub3", "part1"))

    def faults(*found: tuple[int, str, int]) -> int:
        box, height = (0.0, 1.0, 0.0, 1.0), (0.1, 0.2)
        regions = [Region(r, PAYLOADS, PAYLOAD_BODY, box, height, k, o) for r, k, o in found]
        return len(list(Crowding(layout).crowded(regions)))

    assert faults((1, "part3", mate), (2, "sub2", mate)) == 0
    assert faults((1, "part3", mate), (2, "sub2", ALWAYS)) == 0
    assert faults((1, "part3", mate), (4, "part1", ALWAYS)) == 1
    assert faults((1, "part3", mate), (4, "part1", alone)) == 1
