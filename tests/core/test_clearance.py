"""The clearance certificate: it holds for every layout, and fails for every planted fault."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import pytest

from factory.floor.layout.certificate import (
    ALWAYS,
    KINDS,
    PAYLOAD_BODY,
    STATIONS,
    Certificate,
    Region,
)
from factory.floor.layout.clearance import ClearanceSearch, certify, separation
from factory.floor.layout.crossings import touching
from factory.floor.layout.dimensions import PAYLOADS, SIDE
from factory.floor.layout.layout import Layout
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
    """The document alone, checked by comparing all regions with all others."""
    layout = random_layout(*drawn)
    for changed in (layout, shortened(layout, 0, 0.03), with_path(layout, 0, arm=-0.3)):
        found = certify(changed)
        document = json.loads(json.dumps(found.as_json()))
        assert document["schema"] == 1 and document["holds"] == found.holds
        overlaps = [fault for fault in found.faults if fault.layer]
        assert bool(every_pair(document)) == bool(overlaps)


def every_pair(document: dict[str, Any]) -> list[tuple[Any, Any]]:
    """The pairs of regions in a certificate's document that are too near for no reason in it."""
    c = document["clearance_m"] - 2e-6
    shared = {tuple(sorted(pair["robots"])) for pair in document["shared"]}
    wrong = []
    for one, other in combinations(document["regions"], 2):
        stations = [region["of"] in [KINDS[k] for k in STATIONS] for region in (one, other)]
        if one["layer"] != other["layer"] or separation(one["box"], other["box"]) >= c:
            continue
        if one["robot"] == other["robot"] and stations[0] == stations[1]:
            continue
        made = any(r["of"] == "payload" and r["operation"] is None for r in (one, other))
        if one["robot"] == other["robot"] and "outfeed" in (one["of"], other["of"]) and not made:
            continue
        lower, upper = sorted((one["z"], other["z"]))
        raised = {"boom", "housing"} & {one["of"], other["of"]}
        if raised and upper[0] - lower[1] >= c:
            continue
        coupled = one["operation"] is not None or other["operation"] is not None
        pair = tuple(sorted((one["robot"], other["robot"])))
        if coupled and not any(stations) and pair in shared:
            continue
        wrong.append((one, other))
    return wrong


def test_boxes_are_as_far_apart_as_their_corners() -> None:
    assert separation((0, 1, 0, 1), (4, 6, 5, 6)) == separation((4, 6, 5, 6), (0, 1, 0, 1)) == 5


def test_the_paper_s_example_shares_its_junctions() -> None:
    found = paper_layout().certificate
    assert found is not None
    shared = {(pair.robots, pair.operations) for pair in found.shared}
    assert (("r5", "r6"), ("sub1",)) in shared
    assert (("r2", "r3"), ("sub3",)) in shared
    assert (("r1", "r2"), ("sub3",)) in shared
    points = {pair.operations[0]: pair.point for pair in found.shared}
    b = paper_layout().guidepaths[0].middle(paper_layout().guidepaths[0].length)
    assert points["sub3"] == pytest.approx(b)


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
        assert not found.holds, name
        assert max(fault.lacking for fault in found.faults) >= 0.029 - SIDE
    alone = with_path(layout, 2, travel=layout.guidepaths[2].travel - 0.03)
    broken(alone, "r3 stands 30.0 mm beyond the end of its guidepath")
    alone = with_visits(alone, stations_of(layout))
    broken(alone, "ends 30.0 mm away from the junction of 'sub1' on r3's guidepath")


def test_a_fault_says_where_and_by_how_much() -> None:
    found = certify(shortened(paper_layout(), 4, 0.012))
    fault = next(fault for fault in found.faults if set(fault.robots) == {"r5", "r3"})
    assert fault.lacking == pytest.approx(0.012, abs=0.0015 + SIDE)
    assert fault.layer == "payloads"
    assert {"part1", "sub1"} & set(fault.labels)
    assert len(fault.positions) == 2
    diagnostic = fault.diagnostic()
    assert diagnostic.code == "Layout"
    assert "mm apart in the layer of payloads; 20 mm are needed" in diagnostic.message
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
    broken(both, factory.robots[guest].name, neighbour, "overlap")


def test_a_mirrored_side() -> None:
    layout = random_layout(16, 8, "balanced", "far")
    for robot in range(1, len(layout.guidepaths)):
        path = layout.guidepaths[robot]
        mirrored = with_path(layout, robot, side=(-path.side[0], -path.side[1]))
        broken(mirrored, layout.factory.robots[robot].name, "it is mirrored")
    paper = paper_layout()
    wrong_way = (-paper.guidepaths[4].heading[0], -paper.guidepaths[4].heading[1])
    broken(with_path(paper, 4, heading=wrong_way), "r5's", "r6's", "overlap")
    broken(with_path(layout, 1, heading=layout.guidepaths[1].side), "no axes at right angles")


def test_arms_past_the_rim() -> None:
    layout = paper_layout()
    for robot in (1, 3, 4, 5):
        past = layout.guidepaths[robot].arm - 0.03
        name = layout.factory.robots[robot].name
        broken(with_path(layout, robot, arm=past), f"{name}'s arm", "mast", "in the layer of masts")


def test_a_larger_payload_than_the_layout_knew() -> None:
    layout = paper_layout()
    for part in ("part1", "part2", "part3"):
        for by in (0.002, 0.05):
            found = certify(grown(layout, part, by))
            assert not found.holds
            assert any(part in fault.labels or fault.labels for fault in found.faults)


def test_a_post_in_the_way() -> None:
    """A layout that takes a part for longer puts its post farther back, some day where another
    is."""
    layout = random_layout(30, 2, "balanced", "medium")
    found = set()
    for leaf in layout.factory.leaves:
        xlo, xhi, ylo, yhi = layout.payloads[leaf.label]
        for far in (0.1, 0.3, 0.6):
            longer = (xlo - far, xhi + far, ylo - far, yhi + far)
            payloads = {**layout.payloads, leaf.label: longer}
            for fault in certify(replace(layout, payloads=payloads, certificate=None)).faults:
                if f"the post of '{leaf.label}''s feeder" in fault.message:
                    found.add(leaf.label)
                    assert layout.factory.robots[leaf.carrier].name in fault.robots
    assert len(found) >= 5


def test_the_outfeed_in_the_way() -> None:
    layout = paper_layout()
    xlo, xhi, ylo, yhi = layout.outfeed
    broken(
        replace(layout, outfeed=(xlo - 0.01, xhi, ylo, yhi), certificate=None),
        "the outfeed",
        "sub3",
    )


def test_an_insertion_with_a_wrong_standoff(monkeypatch: pytest.MonkeyPatch) -> None:
    layout = row_of_inserts()
    monkeypatch.setattr(Layout, "standoff", lambda self, operation, slot: 0.0)
    broken(layout, "waits", "mm from the way of")
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
        small, large = (random_layout(n, 1, shape, "plain").certificate for n in (40, 120))
        assert small and large
        robots = len(large.robots) / len(small.robots)
        assert len(large.regions) <= 1.3 * robots * len(small.regions)
        assert large.pairs <= 1.3 * robots * small.pairs
        assert len(large.shared) <= 1.5 * robots * len(small.shared) + 10


def test_only_who_is_coupled_may_share_room() -> None:
    """Two payloads in one place: of robots in one mode, or of unrelated ones, coupled or not."""
    layout = paper_layout()
    mate, alone = (layout.factory.by_label[label].index for label in ("sub3", "part1"))

    def faults(*found: tuple[int, str, int]) -> int:
        box, height = (0.0, 1.0, 0.0, 1.0), (0.1, 0.2)
        regions = [Region(r, PAYLOADS, PAYLOAD_BODY, box, height, k, o) for r, k, o in found]
        return len(list(ClearanceSearch(layout, regions).faults()))

    assert faults((1, "part3", mate), (2, "sub2", mate)) == 0
    assert faults((1, "part3", mate), (2, "sub2", ALWAYS)) == 0
    assert faults((1, "part3", mate), (4, "part1", ALWAYS)) == 1
    assert faults((1, "part3", mate), (4, "part1", alone)) == 1
