"""Manipulators: a part that is presented turned is taken from above, turned back and lowered."""

from __future__ import annotations

from dataclasses import replace
from math import radians, sqrt
from pathlib import Path

import numpy as np
import pytest

from factory.apps.exports import stock
from factory.apps.exports.ways import ways
from factory.apps.few_robots.folding import folded
from factory.engine.mjcf.loading import load
from factory.engine.mjcf.model import build_model
from factory.engine.record.state import State
from factory.engine.simulation.ordering import Ordering
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.engine.timing.timing import Timing
from factory.floor.geometry.solids import rotation
from factory.floor.geometry.turning import axis_of, presented, turning_box, turning_pieces
from factory.floor.layout.durations import Pace, operation_times
from factory.floor.layout.embedding import lay_out
from factory.floor.layout.layout import Layout, carriers, delivery
from factory.floor.layout.request import Ground
from factory.floor.layout.stops import stops_of
from factory.floor.modes.modes import operation_mode
from factory.pipeline import read
from factory.support.errors import InputError
from factory.support.settings import Settings
from factory.theory.problem.robot_types import load_catalogue
from tests.clearance_values import check
from tests.command_line import Terminal
from tests.good_runs import assert_good
from tests.paths import ROOT
from tests.whole.test_refinement import played

PEG = ROOT / "examples" / "peg.pag"

TWO = """root = cell; cell = place ( base, peg, key );
base = atomic ( box = (0.12, 0.08, 0.02), pos = (0, 0, 0.01) );
peg = atomic ( box = (0.04, 0.02, 0.03), pos = (-0.03, 0, 0.0351), fed = -0.4 );
key = atomic ( box = (0.02, 0.03, 0.02), pos = (0.03, 0.01, 0.0301), fed = 0.8 )"""
"""Two manipulators, one after the other on the way of one robot; the first turns the other way."""


MIX = "mix = 2 one, 1 other; one = place ( base, peg ); other = place ( base, key )"


@pytest.fixture(scope="module")
def cell() -> Layout:
    return read(PEG).layout


def written(folder: Path, text: str) -> Path:
    path = folder / "p.pag"
    path.write_text(text)
    return path


# --- the language ---------------------------------------------------------------------------------


def test_what_is_placed_is_picked_first(cell: Layout) -> None:
    made = {o.label: o.template.name for o in cell.factory.making}
    assert made == {"cell": "place", "base": "atomic", "peg/pick": "pick", "peg": "atomic"}
    assert [not robot.travels for robot in cell.factory.robots] == [False, True, False]


def test_a_pick_that_is_written_is_not_put_in(tmp_path: Path) -> None:
    text = PEG.read_text().replace(
        "place ( base, peg );", "place ( base, held ); held = pick ( peg );"
    )
    text = text.replace('mesh = "peg/base.obj", scale = 0.001', "box = (0.08, 0.08, 0.01)")
    labels = [o.label for o in read(written(tmp_path, text)).compiled.making]
    assert labels == ["cell", "base", "held", "peg"]


@pytest.mark.parametrize(
    ("statement", "code", "words"),
    [
        ("mate ( base, peg )", "NeedsTurn", "'peg' is presented turned by 0.61 rad"),
        ("mate ( base, held ); held = relay ( peg )", "NeedsTurn", "'mate' turns nothing"),
        ("place ( base, held ); held = weld ( peg )", "NeedsTurn", "'weld' turns nothing"),
        ("place ( peg, base )", "NeedsTurn", "'place' turns nothing"),
    ],
)
def test_what_is_presented_turned_has_to_be_turned(
    statement: str, code: str, words: str, tmp_path: Path
) -> None:
    text = PEG.read_text().replace("place ( base, peg )", statement)
    text = text.replace('mesh = "peg/base.obj", scale = 0.001', "box = (0.08, 0.08, 0.01)")
    with pytest.raises(InputError) as refused:
        _ = read(written(tmp_path, text)).factory
    found = {d.code: d.message for d in refused.value.diagnostics}
    assert words in found[code]


def test_what_is_placed_comes_from_above(tmp_path: Path) -> None:
    """A roof over its place, or no shapes at all."""
    parts = "box = (0.08, 0.08, 0.02), pos = (0, 0, 0.06)", "box = (0.04, 0.02, 0.03)"
    for base, peg in (parts, ("", "")):
        text = f"root = c; c = place ( a, b ); a = atomic ( {base} ); b = atomic ( {peg} )"
        with pytest.raises(InputError, match="cannot be lowered") as refused:
            _ = read(written(tmp_path, text)).factory
        assert [d.code for d in refused.value.diagnostics] == ["Blocked"]


def test_a_mix_shares_its_manipulators(tmp_path: Path) -> None:
    """What is made twice in a period has one, fixed still, at a station with two guests."""
    text = TWO.replace("root = cell; cell = place ( base, peg, key )", MIX)
    layout = read(written(tmp_path, text)).layout
    made = layout.factory
    assert [robot.type for robot in made.robots].count("manipulator") == 2
    assert [r.travels for r in made.robots] == [r.type != "manipulator" for r in made.robots]
    guests = [stop.guests for stop in stops_of(made, 0)[0] if stop.joins]
    assert sorted(map(len, guests)) == [2, 2]
    assert len({robot for pair in guests for robot in pair}) == 4
    assert_good(Simulation(layout, RunRequest(units=3, seed=1, jitter=0.3)).run())


def test_a_fold_keeps_robots_fixed(tmp_path: Path) -> None:
    made = read(written(tmp_path, TWO)).factory
    again = folded(made, [], load_catalogue())
    assert [not r.travels for r in again.robots] == [not r.travels for r in made.robots]
    assert sum(not r.travels for r in again.robots) == 2


def test_a_manipulator_goes_no_way_that_can_be_relayed(cell: Layout) -> None:
    assert read(PEG).with_ground(Ground(relay=True)).layout.factory == cell.factory


def test_a_manipulator_needs_a_hand(cell: Layout) -> None:
    layout = lay_out(cell.factory, cell.product)
    with pytest.raises(InputError, match="NoGrip r2 has no hand to turn 'peg/pick' with"):
        Simulation(layout, RunRequest())


# --- the turned part ------------------------------------------------------------------------------


def test_a_part_is_presented_turned_about_its_middle(cell: Layout) -> None:
    peg = cell.product.solids["peg"]
    shown = presented(peg)
    turned = rotation(shown.quaternion) @ rotation(peg.quaternion).T
    assert np.arctan2(turned[1, 0], turned[0, 0]) == pytest.approx(0.61)
    assert axis_of(shown) == pytest.approx(axis_of(peg))
    assert shown.inertia[2, 2] == pytest.approx(peg.inertia[2, 2])
    low, high = turning_box(peg)
    swept = np.concatenate(turning_pieces(peg))
    for share in np.linspace(0, 1, 50):
        points = presented(replace(peg, fed=float(share * peg.fed))).pieces[0]
        assert (points >= low - 1e-9).all() and (points <= high + 1e-9).all()
        for way in np.linspace(0, 2 * np.pi, 60):
            out = np.array([np.cos(way), np.sin(way), 0.0])
            assert (points @ out).max() <= (swept @ out).max() + 1e-9


# --- the layout -----------------------------------------------------------------------------------


def test_the_robots_of_a_station_end_there(cell: Layout) -> None:
    factory, paths = cell.factory, cell.guidepaths
    assert carriers(factory) == [-1, 0, 0]
    place = factory.by_label["cell"]
    assert delivery(factory, 2) == place
    assert paths[1].a == paths[2].a == pytest.approx(cell.meeting(place))
    assert [-v for v in paths[2].heading] == pytest.approx(paths[1].heading)
    assert paths[1].turn == -0.61
    assert paths[1].carriage(paths[1].length) == paths[1].carriage(paths[1].reach)
    assert paths[1].middle(0.0) == paths[1].a


def test_a_manipulator_turns_before_it_lowers(cell: Layout) -> None:
    place = cell.factory.by_label["cell"]
    mode = operation_mode(cell, place, 2e-4)
    assert list(mode.gate) == [-1, 0, 1]
    assert mode.goals[1] == pytest.approx(cell.guidepaths[1].reach)
    assert not mode.pairs.size


def test_the_net_keeps_who_brings_and_who_takes_away_apart(cell: Layout) -> None:
    """The robot that brings the peg, and the carrier under the same tool: a checker that knows only
    MJCF, ways and circuits finds nothing, and finds the pair where its circuits are left out."""
    copies = {leaf.label: 1 for leaf in cell.factory.leaves}
    settings = Settings(timestep=0.002)
    model = stock.written(build_model(cell, load_catalogue(), copies, settings))
    assert cell.certificate is not None
    m, machines, clearance = load(model), ways(model), cell.certificate.as_json()
    assert check(m, machines, clearance) == []
    assert {order["place"].split(":")[-1] for order in clearance["orders"]} >= {"peg/pick", "cell"}
    kept = [pair for pair in clearance["excluded"] if {*pair["machines"]} != {"r1", "r3"}]
    assert len(kept) < len(clearance["excluded"])
    faults = check(m, machines, {**clearance, "excluded": kept})
    assert any("part/base" in fault and "r3/" in fault for fault in faults), faults


def test_a_run_is_one_of_the_coordinated_net(cell: Layout, monkeypatch: pytest.MonkeyPatch) -> None:
    assert played(cell, 1) == []
    monkeypatch.setattr(Ordering, "hold_up", lambda *_: False)
    assert any("peg/pick_s without ['order:" in fault for fault in played(cell, 1))


# --- the run --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("seed", "fed"), [(1, 0.61), (2, -0.87), (3, 0.0)])
def test_the_peg_is_placed(seed: int, fed: float, tmp_path: Path) -> None:
    text = PEG.read_text().replace("fed = 0.61", f"fed = {fed}")
    text = text.replace('"peg/', f'"{PEG.parent}/peg/')
    request = RunRequest(units=3, seed=seed, jitter=0.3, settings=Settings(timestep=0.002))
    run = Simulation(read(written(tmp_path, text)).layout, request).run()
    assert_good(run)
    assert run.physics is not None
    assert run.physics.handoff_gap_max_mm <= 0.1
    assert run.physics.handoff_angle_max_deg <= 0.05
    assert (run.physics.product_error_max_mm or 0.0) <= 0.01


def test_two_manipulators_serve_one_robot(tmp_path: Path) -> None:
    layout = read(written(tmp_path, TWO)).layout
    assert [path.turn for path in layout.guidepaths if not path.travels] == [-0.8, 0.4]
    run = Simulation(layout, RunRequest(units=6)).run()
    assert_good(run)
    assert run.predicted_cycle_time_s == pytest.approx(run.cycle_time_s, rel=0.02)


def test_layouts_are_searched_with_the_time_that_a_turn_takes(tmp_path: Path) -> None:
    """By the bounds of other operations: the ticks, and where a robot brakes in the goal ball."""
    layout, chosen = read(written(tmp_path, TWO)).layout, Settings()
    timing, robots = Timing(layout, chosen), layout.factory.robots
    estimates = operation_times(layout, Pace.of(chosen))
    soonest = -timing.tick - sqrt(2 * chosen.eps / chosen.acceleration)
    turning = [o for o in layout.factory.operations if not all(robots[r].travels for r in o.robots)]
    assert len(turning) == 4
    for operation in turning:
        later = timing.delays[operation.index] - estimates[operation.index]
        assert soonest < later < 2 * timing.tick, operation.label


def test_what_is_joined_before_can_be_placed(tmp_path: Path) -> None:
    """The robot that brings it to the manipulator heads across, as one that brings it itself."""
    text = TWO.replace("place ( base, peg, key )", "place ( base, both ); both = mate ( peg, key )")
    layout = read(
        written(tmp_path, text.replace(", fed = -0.4", "").replace(", fed = 0.8", ""))
    ).layout
    assert_good(Simulation(layout, RunRequest(units=3, seed=1, jitter=0.3)).run())


@pytest.mark.parametrize(("degrees", "made"), [(0.3, True), (1.0, False)])
def test_a_peg_turned_wrong_jams(cell: Layout, degrees: float, made: bool) -> None:
    """Contact is real: the pocket leaves 0.2 mm of play."""
    paths, factory = list(cell.guidepaths), cell.factory
    angle = -0.61 + radians(degrees)
    paths[1] = replace(paths[1], turn=angle, travel=-angle)
    pick, visits = factory.by_label["peg/pick"].index, dict(cell.visits)
    visits[pick, 1] = replace(visits[pick, 1], at=paths[1].length)
    wrong = replace(cell, guidepaths=tuple(paths), visits=visits)
    run = Simulation(wrong, RunRequest(units=1, settings=Settings(timestep=0.002))).run()
    assert (run.products == 1) is made
    assert (run.trouble is None) is made
    if made:
        assert run.physics is not None
        assert run.physics.handoff_angle_max_deg == pytest.approx(degrees, abs=0.01)


def test_the_tool_holds_the_peg_as_it_turns(cell: Layout) -> None:
    """While it is in the tool its angle is that of the joint."""
    simulation = Simulation(cell, RunRequest(units=1))
    world, seen = simulation.world, list[float]()
    joint = world.m.joint("r2/turn")
    address = int(world.m.joint("part/peg#1").qposadr[0])
    grip = world.m.equality("grip/r2/peg").id

    def look(_: State) -> None:
        if world.d.eq_active[grip]:
            w, _, _, z = world.d.qpos[address + 3 : address + 7]
            angle = 2 * np.arctan2(z, w)
            left = world.d.qpos[joint.qposadr[0]] - cell.guidepaths[1].reach
            seen.append(abs(angle - left))

    simulation.run([look])
    assert len(seen) > 10
    assert max(seen) < 2e-3


def test_a_manipulator_is_exported(run: Terminal, tmp_path: Path) -> None:
    for form in ("urdf", "dxf", "st"):
        assert run("export", PEG, "--format", form, "-o", tmp_path / form).status == 0
