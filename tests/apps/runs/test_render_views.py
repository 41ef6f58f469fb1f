"""What cameras show: all that moves, large, with nothing in front of it; found without drawing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from factory.apps.log import Log, LogWriter, read_log
from factory.apps.log.model import model_of
from factory.apps.monitor.record import recorded_subject
from factory.engine.mjcf import names
from factory.engine.mjcf.replica import SHOWN, Replica
from factory.engine.record.subject import MonitorSubject
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.film.action import FAINT, SIGNS, Action, Fading, action_of, placed, shape_of
from factory.film.camerawork import Camerawork, Take
from factory.film.following import Viewpoint
from factory.film.history import History
from factory.film.junction import ZOOM, handover_of
from factory.film.picture import Picture, orbit
from factory.film.shot import moment_of, recorded_take
from factory.film.spotlight import DIM, DIMMER, Spotlight
from factory.film.tour import BETWEEN, OPENING, STAYS, Tour
from factory.film.vantage import hidden, overview
from factory.floor.geometry.sight import Framing, View, fit, towards
from factory.support.arrays import Array
from factory.support.engine import mujoco
from factory.theory.problem.pag import NOPART
from tests.examples import without_hands
from tests.opengl import needs_gl
from tests.pag_texts import laid_out

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


# --- framing --------------------------------------------------------------------------------------


@pytest.mark.parametrize("camera", ["overview", "orbit", "top"])
@pytest.mark.parametrize("framing", [WIDE, BESIDE_PANELS, Framing(9 / 16, below=0.1)])
def test_all_that_moves_is_in_the_frame_all_the_time(log, take, replica, camera, framing) -> None:
    viewpoint = Viewpoint(Replica(take.m), camera, framing, take.subject)
    for row in range(0, len(log), max(1, len(log) // 60)):
        moment = moment_of(log, row)
        view = viewpoint.view(moment.shown, 1 / 30, 7 * moment.time)
        assert np.abs(seen(view, moving(replica, moment.shown.qpos))).max() < 1


def test_an_overview_is_from_where_the_shed_is_not_in_front(action) -> None:
    """A shed before the south side is looked past, and with none there it is the south side."""
    usual = fit(action.points, towards(-62.0, 40.0), WIDE)
    ahead = usual.axes[2] * (1.0, 1.0, 0.0)
    low, high = action.points.min(axis=0), action.points.max(axis=0)
    wall = (low + high) / 2 - 0.6 * np.linalg.norm(high - low) * ahead
    shed = (wall + 0.25 * SIGNS * (high - low))[None]
    free = replace(action, shed=shed[:0], housings=shed[:0])
    blocked = replace(free, shed=shed)
    assert hidden(blocked, usual) > 0.2
    assert hidden(blocked, overview(blocked, WIDE)) < 0.05
    assert hidden(free, usual) == 0


@pytest.mark.parametrize("framing", [WIDE, BESIDE_PANELS])
def test_the_frame_is_filled_one_way(replica, action, framing) -> None:
    view = overview(action, framing)
    filled = np.ptp(seen(view, action.framed), axis=0) / 2
    assert filled.max() > 0.85


def test_lifts_are_seen_up_and_down(replica, action) -> None:
    m = replica.m
    strokes = [2 * m.geom(g).size[1] for g in range(m.ngeom) if m.geom(g).name.endswith("/column")]
    if not strokes:
        pytest.skip("this factory has no lift")
    loads = action.robots[:, :, 2]
    assert np.ptp(loads, axis=1).max() > max(strokes)


def test_a_fused_body_may_be_made_of_shells_alone() -> None:
    """All its parts overlap what comes later, so each has a body of its own in it."""
    layout = laid_out(
        "root = all; all = mate(both, c); both = mate(a, b);"
        "a = atomic(); b = atomic(pos = (0.05, 0, 0)); c = atomic(pos = (0.025, 0.02, 0))"
    )
    m = Simulation(layout, RunRequest(fuse=True)).physical.m
    body = m.body(names.part("both", 1)).id
    assert m.body_geomnum[body] == 0
    assert np.ptp(shape_of(m, body), axis=0)[0] > 0.04


def test_an_orbit_is_as_near_as_it_can_be_and_calm() -> None:
    """A camera at an even distance is as far away everywhere as the widest side asks."""
    points = np.random.default_rng(3).uniform((-3, -1, 0), (3, 1, 0.4), (60, 3))
    tight = Framing(16 / 9, 0.0, 0.0, 0.0)
    look = orbit(points, tight)
    views = [look(time) for time in np.arange(0.0, 45.0, 0.25)]
    assert max(np.abs(seen(view, points)).max() for view in views) < 1.002
    away = np.array([view.distance for view in views])
    widest = max(fit(points, view.axes, tight).distance for view in views)
    assert away.max() < 1.05 * widest and away.min() < 0.93 * away.max()
    steps = np.abs(np.diff(away)) / away[1:]
    assert steps.max() < 0.02 and np.abs(np.diff(away, 2)).max() < 0.01 * away.mean()


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


# --- hand-overs -----------------------------------------------------------------------------------


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


def test_a_hand_over_is_seen_from_aside(take) -> None:
    """No robot stands in front of it, or behind it, where it can be otherwise; what the view was
    taken from is left as it was found."""
    replica = Replica(take.m)
    before = replica.d.qpos.copy()
    for label in ("part1", "sub1"):
        if label not in take.subject.factory.by_label:
            return
        view = handover_of(replica, take.subject, label, WIDE).view
        assert (replica.d.qpos == before).all()
        ahead = view.axes[2][:2] / np.linalg.norm(view.axes[2][:2])
        taking = take.subject.factory.by_label["sub1" if label == "part1" else "sub2"]
        held = zip(taking.robots, taking.before, taking.after, strict=True)
        for robot in [robot for robot, *labels in held if set(labels) != {NOPART}]:
            body = replica.m.body(names.carriage(take.subject.factory.robots[robot].name)).id
            along = replica.d.xaxis[replica.m.body_jntadr[body]][:2]
            assert abs(ahead @ along) < 0.9


def test_a_small_part_is_seen_large() -> None:
    """The frame of its hand-over is that of a pin, not of the plate it is put into."""
    layout = laid_out(
        "root = all; all = insert(plate, pin);"
        "plate = atomic(box = (0.16, 0.12, 0.02));"
        "pin = atomic(box = (0.008, 0.008, 0.012), pos = (0.05, 0.03, 0.016))"
    )
    simulation = Simulation(layout, RunRequest("mujoco"))
    m, subject = simulation.physical.m, MonitorSubject.of_run(simulation)
    near = handover_of(Replica(m), subject, "pin", WIDE)
    at = seen(near.view, near.watched[0])
    assert np.abs(at).max() < 0.5 and np.ptp(at[:, 1]) / 2 > 0.15
    assert near.view.range[0] < 0.2 * near.view.distance  # nothing near is cut


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


# --- a tour ---------------------------------------------------------------------------------------


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


@needs_gl
def test_a_still_of_a_tour_is_the_overview(take) -> None:
    with Camerawork(replace(take, picture=Picture((160, 90), renderer="classic")), 2) as work:
        assert isinstance(work.painter.viewpoint, Viewpoint)
        assert work.painter.viewpoint.handover is None
    with Camerawork(replace(take, picture=Picture((160, 90), renderer="classic"))) as work:
        assert isinstance(work.painter.viewpoint, Tour)


# --- fading ---------------------------------------------------------------------------------------


def opacity(replica: Replica, feeder: str) -> float:
    """How opaque a feeder's post is."""
    return float(replica.m.geom(f"{feeder}/post").rgba[3])


def first_feeder(m: mujoco.MjModel) -> str:
    posts = (m.geom(g).name for g in range(m.ngeom))
    return next(name for name in posts if name.endswith("/post")).removesuffix("/post")


def test_a_post_in_front_fades_and_one_behind_does_not(take) -> None:
    replica = Replica(take.m)
    fading, feeder = Fading(replica), first_feeder(take.m)
    post = placed(replica.m, replica.d, replica.m.geom(f"{feeder}/post").id)
    for azimuth in (-90.0, 0.0, 90.0, 180.0):
        axes = towards(azimuth, 10.0)
        ahead = np.array([axes[2][0], axes[2][1], 0.0])
        view = fit(post, axes, WIDE)
        fading.fade(view, (post + 0.3 * ahead)[None])
        assert opacity(replica, feeder) < FAINT + 0.05
        fading.fade(fit(post, axes, WIDE), (post - 0.3 * ahead)[None])
        assert opacity(replica, feeder) == 1.0


def test_what_fades_keeps_its_colour_and_robots_never_fade(take, action) -> None:
    replica = Replica(take.m)
    before = replica.m.geom_rgba.copy()
    fading = Fading(replica)
    fading.fade(overview(action, WIDE), action.robots)
    changed = np.flatnonzero((replica.m.geom_rgba != before).any(axis=1))
    faded = [g for g in changed if replica.m.geom_rgba[g, 3] < 1]
    assert faded
    m, material = replica.m, take.m.geom_matid
    for g in changed:
        assert names.kind(m.geom(g).name) in ("feeder", "outfeed")
        worn = m.mat_rgba[material[g]] if material[g] >= 0 else before[g]
        assert np.allclose(m.geom_rgba[g, :3], worn[:3])


def test_fading_is_of_the_view_alone(take, action) -> None:
    """Films and stills, runs and logs show the same: what was seen before plays no part."""
    one, other = Replica(take.m), Replica(take.m)
    look = orbit(action.points, WIDE)
    first, second = Fading(one), Fading(other)
    for time in (0.0, 9.0, 20.0, 31.0):
        first.fade(look(time), action.robots)
    second.fade(look(31.0), action.robots)
    assert (one.m.geom_rgba == other.m.geom_rgba).all()


def test_what_fades_in_an_orbit_takes_a_quarter_of_a_second_at_least(take, action) -> None:
    replica = Replica(take.m)
    fading, look = Fading(replica), orbit(action.points, WIDE)
    last, steps = None, []
    for time in np.arange(0.0, 45.0, 1 / 15):
        fading.fade(look(float(time)), action.robots)
        alpha = replica.m.geom_rgba[fading.geoms, 3].copy()
        steps += [] if last is None else [np.abs(alpha - last).max()]
        last = alpha
    assert 0.01 < max(steps) < 0.3
