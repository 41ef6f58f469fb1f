"""What cameras show: all that moves, large, with nothing in front of it; found without drawing."""

from __future__ import annotations

import numpy as np
import pytest

from factory.apps.log import Log, LogWriter, read_log
from factory.apps.log.model import model_of
from factory.apps.monitor.record import recorded_subject
from factory.engine.mjcf import names
from factory.engine.mjcf.replica import SHOWN, Replica
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.film.action import Action, Fading, action_of, placed
from factory.film.camerawork import Take
from factory.film.following import Viewpoint
from factory.film.history import History
from factory.film.junction import ZOOM, handover_of
from factory.film.picture import Picture, orbit
from factory.film.shot import moment_of, recorded_take
from factory.film.spotlight import DIM, DIMMER, Spotlight
from factory.film.tour import BETWEEN, OPENING, STAYS, Tour
from factory.support.arrays import Array
from factory.support.engine import mujoco
from factory.support.pictures.sight import Framing, View
from tests.examples import without_hands

WIDE, BESIDE_PANELS = Framing(16 / 9, below=0.1), Framing(716 / 720, below=0.1)


@pytest.fixture(scope="module", params=["paper", "lamp"])
def log(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Log:
    """The log of a factory without lifts, and of one with."""
    path = tmp_path_factory.mktemp("log") / "run.log"
    layout = without_hands(request.param)
    simulation = Simulation(layout, RunRequest("mujoco", units=2))
    with LogWriter(path, simulation) as writer:
        simulation.run([writer.observe])
    return read_log(path)


@pytest.fixture(scope="module")
def take(log: Log) -> Take:
    return recorded_take(log, lambda: (model_of(log), recorded_subject(log.header)), Picture())


@pytest.fixture(scope="module")
def replica(take: Take) -> Replica:
    return Replica(take.m)


@pytest.fixture(scope="module")
def action(replica: Replica) -> Action:
    return action_of(replica.m, Replica(replica.m).d)


def seen(view: View, points: np.ndarray) -> np.ndarray:
    """Where points are in a view (n, 2): from -1 to 1 within the frame, either way."""
    right, up, ahead = view.axes @ (points - view.position).T
    assert (ahead > 0).all()
    return np.stack([right / ahead / view.wide, up / ahead / view.tall], axis=1)


def moving(replica: Replica, row: np.ndarray) -> np.ndarray:
    """Corners of what moves in a state: robots, rods of feeders, and parts that are in sight and
    not in the shed."""
    m, d = replica.m, replica.d
    replica.place(row)
    wall = m.geom("outfeed/wall1")
    mouth = float(wall.pos[0] - wall.size[0])
    found = []
    for g in range(m.ngeom):
        body = m.body(int(m.body_rootid[m.geom_bodyid[g]]))
        inside = body.name.startswith("part/") and d.xpos[body.id, 2] > 0
        rod = m.geom(g).name.endswith("/rod")
        if (inside and d.xpos[body.id, 0] < mouth) or names.kind(body.name) == "robot" or rod:
            found.append(placed(m, d, g))
    return np.concatenate(found)


@pytest.mark.parametrize("camera", ["overview", "orbit", "top"])
@pytest.mark.parametrize("framing", [WIDE, BESIDE_PANELS, Framing(9 / 16, below=0.1)])
def test_all_that_moves_is_in_the_frame_all_the_time(log, take, replica, camera, framing) -> None:
    viewpoint = Viewpoint(Replica(take.m), camera, framing, take.subject)
    for row in range(0, len(log), max(1, len(log) // 60)):
        moment = moment_of(log, row)
        view = viewpoint.view(moment.shown, 1 / 30, 7 * moment.time)
        assert np.abs(seen(view, moving(replica, moment.shown.qpos))).max() < 1


def test_lifts_are_seen_up_and_down(replica, action) -> None:
    m = replica.m
    strokes = [2 * m.geom(g).size[1] for g in range(m.ngeom) if m.geom(g).name.endswith("/column")]
    if not strokes:
        pytest.skip("this factory has no lift")
    loads = action.robots[:, :, 2]
    assert np.ptp(loads, axis=1).max() > max(strokes)


@pytest.mark.parametrize("camera", ["product", "part:{}"])
def test_what_is_followed_is_watched_in_all_its_eighths(log, take, replica, camera) -> None:
    """A post that hides an eighth of a product stands in front of it."""
    label = take.subject.factory.leaves[0].label
    viewpoint = Viewpoint(Replica(take.m), camera.format(label), WIDE, take.subject)
    moment = moment_of(log, len(log) // 2)
    view = viewpoint.view(moment.shown, 0.0, moment.time)
    eighths = viewpoint.watched
    assert eighths.shape == (8, 8, 3) and np.abs(seen(view, eighths.reshape(-1, 3))).max() < 1
    sizes = np.ptp(eighths, axis=1)
    assert np.allclose(2 * sizes, np.ptp(eighths.reshape(-1, 3), axis=0))


@pytest.mark.parametrize("framing", [WIDE, BESIDE_PANELS])
def test_each_hand_over_is_seen_from_near_by(log, take, framing) -> None:
    """When the operation that takes a label ends, its parts are where the camera looks, and in the
    frame with the pads of the robots, where the parts are not small beside these; they fill it."""
    factory, m = take.subject.factory, take.m
    for node in factory.pag.nodes:
        viewpoint = Viewpoint(Replica(m), f"handover:{node.label}", framing, take.subject)
        taking = factory.operations[factory.parents[factory.by_label[node.label].index]]
        times = (t for t, name in log.events if name == f"{taking.label}_e")
        row = log.row_at(next(times)) - 1
        replica, moment = Replica(m), moment_of(log, row)
        replica.place(log.qpos[row])
        view = viewpoint.view(moment.shown, 0.0, moment.time)
        there = np.concatenate([placed(m, replica.d, g) for g in _geoms_of(m, factory, node.label)])
        assert np.abs(there.min(axis=0) - viewpoint.watched[0].min(axis=0)).max() < 2e-3
        assert np.abs(there.max(axis=0) - viewpoint.watched[0].max(axis=0)).max() < 2e-3
        label, hands = seen(view, there), seen(view, np.concatenate(viewpoint.watched))
        large = np.ptp(label, axis=0).max() / 2 > 1 / (1.5 * ZOOM)
        assert np.abs(label).max() < 1.0
        assert np.abs(hands).max() < 1.0 or large, node.label
        assert np.ptp([*label, *hands], axis=0).max() > 0.7 or large, node.label
        assert len(viewpoint.watched) > 1, "no pad is seen"
        share = shown_share(replica, _geoms_of(m, factory, node.label), view.position)
        assert share > 0.3, f"{node.label}: {share:.2f} is seen"


def shown_share(replica: Replica, geoms: list[int], eye: np.ndarray) -> float:
    """The share of rays from a camera to geoms that meet these first, or a post, which fades."""
    m, d, found = replica.m, replica.d, []
    for geom in geoms:
        box = placed(m, d, geom)
        for weights in np.random.default_rng(0).dirichlet(np.ones(8), 40):
            ray, hit = weights @ box - eye, np.zeros(1, np.int32)
            mujoco.mj_ray(m, d, eye, ray, None, 1, -1, hit, None)
            name = m.geom(int(hit[0])).name if hit[0] >= 0 else ""
            found.append(hit[0] in geoms or name.endswith(("/post", "/boom")))
    return float(np.mean(found))


def _geoms_of(m: mujoco.MjModel, factory, label: str) -> list[int]:
    """The geoms of the first copies of a label's parts."""
    bodies = {names.part(part, 1) for part in factory.contents[label]}
    return [g for g in range(m.ngeom) if m.body(int(m.geom_bodyid[g])).name in bodies]


def test_robots_that_a_hand_over_does_not_concern_fade(log, take) -> None:
    replica, factory = Replica(take.m), take.subject.factory
    m, before = replica.m, replica.m.geom_rgba.copy()
    spotlight = Spotlight(replica)
    taking = next(o for o in factory.making if len(o.inputs) > 1)
    near = handover_of(replica, take.subject, taking.inputs[-1], WIDE)
    assert near.robots == {factory.robots[r].name for r in taking.robots}
    row = log.row_at(next(t for t, name in log.events if name == f"{taking.label}_s")) - 1
    shown = moment_of(log, row).shown
    spotlight.aim(near.robots, shown)
    grips = [
        (m.equality(int(e)).name.split("/")[1], int(body))
        for e, body in zip(shown.active, shown.body2, strict=True)
        if m.equality(int(e)).name.startswith("grip/")
    ]
    assert any(robot in near.robots for robot, _ in grips)
    for g in range(m.ngeom):
        body = int(m.body_rootid[m.geom_bodyid[g]])
        name, alpha = m.body(body).name, float(m.geom_rgba[g, 3])
        holders = {robot for robot, held in grips if held == body}
        if names.kind(name) == "robot":
            assert (alpha < DIM + 0.01) == (name.partition("/")[0] not in near.robots)
        elif holders:
            assert (alpha < DIMMER + 0.01) == holders.isdisjoint(near.robots)
        else:
            assert (m.geom_rgba[g] == before[g]).all()
    groups = take.m.geom_group
    assert (m.geom_group == groups).all()  # there is no mesh among these parts
    parts = [g for own in spotlight.loads.values() for g in own if groups[g] < SHOWN]
    m.geom_type[parts] = mujoco.mjtGeom.mjGEOM_MESH
    spotlight.aim(near.robots, shown)
    out = np.flatnonzero(m.geom_group != groups).tolist()
    assert {*out} <= {*parts} and (m.geom_group[out] == SHOWN).all()
    others = {body for robot, body in grips if robot not in near.robots}
    assert {int(m.body_rootid[m.geom_bodyid[g]]) for g in out} <= others
    spotlight.aim(None, shown)
    assert (m.geom_rgba == before).all() and (m.geom_group == groups).all()


def carriage_at(log: Log, take: Take, robot: str, time: float) -> Array:
    """Where a robot's carriage is at a time of a log (3,) [m]."""
    d = mujoco.MjData(take.m)
    d.qpos[:] = moment_of(log, log.row_at(time)).shown.qpos
    mujoco.mj_kinematics(take.m, d)
    return np.array(d.body(names.carriage(robot)).xpos)


def test_a_tour_cuts_at_events(log, take) -> None:
    """From the overview to a hand-over that has started, when its carrier is there, back a moment
    after its end or when the carrier goes on, and in the end to the delivery of the last
    product."""
    factory, history = take.subject.factory, History(take.subject)
    history.catch_up(log.timed_entries, float("inf"))
    tour = Tour(Replica(take.m), WIDE, history, 2)
    close = list[View]()
    cuts, last = list[tuple[float, frozenset[str] | None]](), None
    for time in np.arange(0.0, float(log.time[-1]), 1 / 30):
        shown = moment_of(log, log.row_at(float(time))).shown
        view = tour.view(shown, 1 / 30, float(time))
        if tour.near and not tour.last:
            close.append(view)
            assert tour.near.is_there(take.m, shown.qpos)
        if tour.concerned != last:
            cuts.append((float(time), tour.concerned))
            last = tour.concerned
    (first, robots), (back, nobody), *_, (end, output) = cuts
    starts = [(t, factory.by_label[name[:-2]]) for t, name in log.events if name.endswith("_s")]
    ends = [(t, name[:-2]) for t, name in log.events if name.endswith("_e")]
    of = [(t, o) for t, o in starts if robots == {factory.robots[r].name for r in o.robots}]
    when, taking = next((t, o) for t, o in reversed(of) if t < first)
    done = next(t for t, label in ends if label == taking.label and t > when)
    assert len(taking.inputs) > 1 and when < first < done
    carrier = factory.robots[taking.robots[taking.template.carrier - 1]]
    foot = [carriage_at(log, take, carrier.name, t) for t in np.arange(first, back, 1 / 30)]
    there = carriage_at(log, take, carrier.name, done)
    away = np.abs(seen(close[0], np.array(foot)) - seen(close[0], there[None]))
    assert away.max() < 0.4, "its carrier is where it works, in halves of the picture"
    assert nobody is None and 0 < back - done <= STAYS + 1 / 30 + 1e-6
    assert first >= OPENING
    others = [time for time, concerned in cuts[1:-1] if concerned]
    assert all(time - back >= BETWEEN for time in others)
    whole = [t for t, label in ends if label in factory.products][-1]
    assert output == {factory.robots[0].name} and whole < end <= whole + STAYS + 1 / 30


def test_fading_is_of_the_view_alone(take, action) -> None:
    """Films and stills, runs and logs show the same: what was seen before plays no part."""
    one, other = Replica(take.m), Replica(take.m)
    look = orbit(action.points, WIDE)
    first, second = Fading(one), Fading(other)
    for time in (0.0, 9.0, 20.0, 31.0):
        first.fade(look(time), action.robots)
    second.fade(look(31.0), action.robots)
    assert (one.m.geom_rgba == other.m.geom_rgba).all()
