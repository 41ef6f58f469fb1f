"""Welds, hands and masks: what is said last of a weld or body counts, all is written at once, and
nothing else differs from writing it one after the other."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from factory.engine.mjcf.masks import ALL, NOBODY
from factory.engine.simulation.mujoco.contacts import LAST
from factory.engine.simulation.mujoco.sleep import AWAKE, FRESH
from factory.engine.simulation.mujoco.world import MujocoWorld
from tests.good_runs import random_marking
from tests.pag_texts import laid_out
from tests.simulation_values import FENCE, layout_of, ready


def under_way(name: str = "paper", **given: Any) -> MujocoWorld:
    """A world after forty ticks."""
    simulation = ready(name, **given)
    for _ in range(40):
        simulation.supervisor.step()
    return simulation.physical


def test_what_is_said_last_of_a_weld_holds() -> None:
    world = under_way()
    m, d, welds = world.m, world.d, world.parts.welds
    one, other, third, fourth = [*world.parts.holdings.weld.values()][:4]
    before = int(m.eq_obj2id[other])
    welds.close({one: 5})
    welds.close({other: 6})
    welds.close({third: 5})
    welds.open([other])
    welds.open([third])
    welds.close({third: 7})
    welds.open([fourth])
    assert not d.eq_active[one], "nothing is written yet"
    welds.write()
    assert d.eq_active[[one, other, third, fourth]].tolist() == [1, 0, 1, 0]
    assert m.eq_obj2id[[one, other, third]].tolist() == [5, before, 7]
    d.eq_active[one] = 0
    welds.write()
    assert not d.eq_active[one], "it is written once"


def test_what_is_said_last_of_a_body_holds() -> None:
    world = under_way()
    m, d, parts = world.m, world.d, world.parts
    body, other = (int(parts.holdings.body[label][0]) for label in ("part1", "part2"))
    parts.welds.place(body, (1.0, 2.0, 3.0))
    parts.welds.place(body, (4.0, 5.0, 6.0))
    parts.welds.place(other, (7.0, 8.0, 9.0))
    parts.welds.set_holder([body, other], 3)
    parts.welds.set_holder([other], NOBODY)
    d.qvel[m.body_dofadr[body]] = 1.0
    parts.welds.write()
    at, v = m.jnt_qposadr[m.body_jntadr[body]], m.body_dofadr[body]
    assert d.qpos[at : at + 7].tolist() == [4, 5, 6, 1, 0, 0, 0]
    assert (d.qvel[v : v + 6] == 0.0).all()
    assert d.xpos[[body, other]].tolist() == [[4, 5, 6], [7, 8, 9]]
    assert parts.masks.code[[body, other]].tolist() == [3, NOBODY]
    for each, own, others in ((body, 6, ((~3 & ALL) << 1) | 1), (other, 0, 0)):
        for geom in parts.masks.solid[each]:
            assert (m.geom_contype[geom], m.geom_conaffinity[geom]) == (own, others)
        assert (m.body_contype[each], m.body_conaffinity[each]) == (own, others)


def collide(one: tuple[int, int], other: tuple[int, int]) -> bool:
    """Whether bodies with these masks do, by the engine's rule."""
    return bool(one[0] & other[1] or other[0] & one[1])


def test_parts_collide_exactly_if_their_holders_differ() -> None:
    """And with robots and stations always, whose bit is the lowest; spare ones with nothing."""
    world = under_way("20")
    m, masks = world.m, world.parts.masks
    bodies, codes = [*masks.solid][:8], (1, 2, 3, 1, 500, 3, NOBODY, NOBODY)
    masks.hold(dict(zip(bodies, codes, strict=True)))
    found = [(int(m.body_contype[b]), int(m.body_conaffinity[b])) for b in bodies]
    for one, first in zip(codes, found, strict=True):
        assert collide(first, (1, 1)) == (one != NOBODY)
        for other, second in zip(codes, found, strict=True):
            assert collide(first, second) == (one != other and NOBODY not in (one, other))


def test_what_a_weld_joins_and_joined_is_woken() -> None:
    world = under_way()
    m, d, parts = world.m, world.d, world.parts
    grip = parts.holdings.grips()
    tree = {label: m.body_treeid[ids[0]] for label, ids in parts.holdings.body.items()}
    first = {label: m.body_dofadr[ids[0]] for label, ids in parts.holdings.body.items()}
    for label in ("part1", "part2"):
        d.tree_asleep[tree[label]] = tree[label]
        d.qvel[first[label] : first[label] + 6] = 0.0
    d.tree_asleep[tree["part3"]] = -1
    weld = grip[0, "part1"]
    m.eq_obj2id[weld] = parts.holdings.body["part2"][0]
    joins = next(w for (robot, label), w in grip.items() if robot and label == "part3")
    for name, body in (("holder", m.eq_obj1id[weld]), ("other", m.eq_obj1id[joins])):
        tree[name], first[name] = m.body_treeid[body], m.body_dofadr[body]
        d.tree_asleep[tree[name]] = tree[name]
        d.qvel[first[name]] = 0.0
    welds = parts.welds
    welds.open([weld])
    welds.close({weld: int(parts.holdings.body["part1"][0])})
    part3 = int(parts.holdings.body["part3"][0])
    welds.close({parts.feeders.welds["part3"]: part3, joins: part3})
    welds.write()
    for label, dofs in (("part1", 6), ("holder", 1), ("other", 1)):
        speeds = d.qvel[first[label] : first[label] + dofs]
        assert (speeds == 0.0).all() and (np.signbit(speeds) == np.signbit(AWAKE)).any(), label
    assert d.tree_asleep[tree["part3"]] == FRESH


def test_what_a_weld_lets_go_is_woken() -> None:
    world = under_way()
    m, d, parts = world.m, world.d, world.parts
    weld, body = parts.holdings.weld[1, "part1"], int(parts.holdings.body["part2"][0])
    m.eq_obj2id[weld] = body
    tree, first = m.body_treeid[body], m.body_dofadr[body]
    d.tree_asleep[tree] = tree
    d.qvel[first : first + 6] = 0.0
    parts.welds.open([weld])
    parts.welds.write()
    assert np.signbit(d.qvel[first : first + 6]).any()


# --- gaps -----------------------------------------------------------------------------------------


def test_gaps_are_those_where_bodies_are_taken_over() -> None:
    """How far a body is from where its weld holds it then, by the engine's poses of now; bodies
    that are only joined are not measured."""
    world = under_way()
    m, d, parts = world.m, world.d, world.parts
    grip, body = parts.holdings.weld[1, "part1"], int(parts.holdings.body["part1"][0])
    before, count = parts.welds.taken.gap, parts.welds.taken.count
    parts.welds.close({grip: body})
    parts.welds.write()
    assert (parts.welds.taken.gap, parts.welds.taken.count) == (before, count)
    at = m.jnt_qposadr[m.body_jntadr[body]]
    holder = m.eq_obj1id[grip]
    turn = d.xmat[holder].reshape(3, 3)
    d.qpos[at : at + 3] = d.xpos[holder] + turn @ m.eq_data[grip, 3:6] + [0.0, 0.3, 0.4]
    parts.welds.close_and_measure({grip: body})
    parts.welds.write()
    assert parts.welds.taken.count == count + 1
    assert parts.welds.taken.gap == pytest.approx(0.5, abs=2e-3)


def test_a_loosened_grip_is_not_measured() -> None:
    """A weld that is let go in the same tick in which it took over holds nothing."""
    world = under_way()
    parts, count = world.parts, world.parts.welds.taken.count
    grip, body = parts.holdings.weld[1, "part1"], int(parts.holdings.body["part1"][0])
    parts.welds.close_and_measure({grip: body})
    parts.welds.open([grip])
    parts.welds.write()
    assert not world.d.eq_active[grip]
    assert parts.welds.taken.count == count


# --- hands ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "given"), [("paper", {"fuse": True}), ("fence", {}), ("20", {"wip": 2})]
)
def test_every_part_has_one_holder(name: str, given: dict[str, Any]) -> None:
    """In every tick each body that is no spare one is held by one weld, of the holder whose code it
    has; spare ones are parked and touch nothing."""
    simulation = ready(name, **given)
    world = simulation.physical
    m, d, parts = world.m, world.d, world.parts
    code_of = dict(parts.holdings.welds())
    while world.delivered() < 2:
        simulation.supervisor.step()
        active = np.flatnonzero(d.eq_active)
        held = {int(m.eq_obj2id[w]): code_of.get(int(w), NOBODY) for w in active.tolist()}
        assert len(held) == len(active)
        assert {b: int(parts.masks.code[b]) for b in parts.masks.solid} == held
        for robot, bodies in parts.holdings.in_hands().items():
            for label, body in bodies.items():
                assert held[body] == robot + 1
                assert parts.holdings[label, parts.holdings.of(body).unit] == body


def test_a_feeder_that_ran_dry_shows_a_part_once_one_has_come_back() -> None:
    """All copies of a part but the one that is shown are missing."""
    simulation = ready("paper", units=3)
    simulation.physical.parts.holdings.free["part1"].clear()
    run = simulation.run(max_time=60.0)
    assert (run.products, run.trouble) == (3, None)


@pytest.mark.parametrize("seed", range(4))
def test_a_run_from_a_marking_begins_with_what_robots_hold(seed: int) -> None:
    """Where the welds hold it: nothing jumps."""
    start = random_marking(layout_of("paper"), seed)
    world = ready("paper", start=start).physical
    places = world.d.xpos.copy()
    for _ in range(20):
        world.advance(1)
    held = [body for held in world.parts.holdings.in_hands().values() for body in held.values()]
    assert np.abs(world.d.xpos[held] - places[held]).max(initial=0.0) < 1e-4
    assert not world.inspection.unintended


def test_excluded_pairs_of_one_unit_do_not_collide() -> None:
    """In every tick the engine's list has the pairs of those that are in the factory, sorted."""
    simulation = ready(laid_out(FENCE))
    world, lengths = simulation.physical, set()
    listed, excluded = world.m.exclude_signature.view(np.uint32), world.model.excluded
    assert excluded
    while world.delivered() < 2:
        simulation.supervisor.step()
        present = world.parts.holdings
        units = {holding.unit for _, holding in present.rows()}
        pairs = [
            sorted((present[one, unit], present[other, unit]))
            for one, other in excluded
            for unit in units
            if (one, unit) in present and (other, unit) in present
        ]
        expected = sorted((low << 16) + high for low, high in pairs)
        assert listed[: len(pairs)].tolist() == expected
        assert (listed[len(pairs) :] == LAST).all()
        lengths.add(len(pairs))
    assert len(lengths) > 2
    assert not world.inspection.unintended
