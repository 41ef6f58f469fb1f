"""What is switched in a tick is switched at once: what is said last holds, and nothing else differs
from switching it one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from factory.plant.factory import Operation
from factory.simulation.mujoco.fast import broad_phase as vicinity_of_what_moves
from factory.simulation.mujoco.parts import Stock
from factory.simulation.mujoco.welds import AWAKE, FRESH, Switchboard
from factory.simulation.request import RunRequest
from factory.simulation.simulation import Simulation
from tests.test_vicinity import layout, states


def a_board() -> tuple[Switchboard, Stock]:
    simulation = Simulation(layout("paper"), RunRequest(units=2))
    for _ in range(40):
        simulation.supervisor.step()
    return simulation.world.stock.board, simulation.world.stock


def test_what_is_said_last_of_a_weld_holds() -> None:
    board, stock = a_board()
    m, d = stock.m, stock.d
    one, other, third, fourth = [*stock.grip.values()][:4]
    before = int(m.eq_obj2id[other])
    board.join([one], [5])
    board.join([other], [6])
    board.join([third], [5])
    board.loose([other])
    board.loose([third])
    board.join([third], [7])
    board.loose([fourth])
    board.write()
    assert d.eq_active[[one, other, third, fourth]].tolist() == [1, 0, 1, 0]
    assert m.eq_obj2id[[one, other, third]].tolist() == [5, before, 7]
    d.eq_active[one] = 0
    board.write()
    assert not d.eq_active[one], "it is written once"


def test_what_is_said_last_of_a_body_holds() -> None:
    board, stock = a_board()
    m, d = stock.m, stock.d
    body, other = (int(stock.body[label][0]) for label in ("part1", "part2"))
    board.place([body], [(1.0, 2.0, 3.0)])
    board.place([body, other], [(4.0, 5.0, 6.0), (7.0, 8.0, 9.0)])
    board.hold([body, other], 3)
    board.hold([other], 0)
    board.write()
    at = m.jnt_qposadr[m.body_jntadr[body]]
    assert d.qpos[at : at + 7].tolist() == [4, 5, 6, 1, 0, 0, 0]
    assert d.xpos[[body, other]].tolist() == [[4, 5, 6], [7, 8, 9]]
    assert stock.contacts.code[[body, other]].tolist() == [3, 0]
    for each, own, others in ((body, 6, ~6 & (2**31 - 1)), (other, 0, 0)):
        for geom in stock.contacts.solid[each]:
            assert (m.geom_contype[geom], m.geom_conaffinity[geom]) == (own, others)
        assert (m.body_contype[each], m.body_conaffinity[each]) == (own, others)


def test_what_is_put_somewhere_is_looked_at_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(vicinity_of_what_moves, "FEW", 0)
    simulation = Simulation(layout("20"), RunRequest(units=2))
    for _ in range(40):
        simulation.supervisor.step()
    world = simulation.world
    board, vicinity, stock = world.stock.board, world.vicinity, world.stock
    holder, label = next(pair for pair in stock.grip if pair[1] in stock.feed)
    body = int(stock.body[label][-1])
    vicinity.look()
    board.place([body], [tuple(world.d.xpos[world.body[holder]])])
    board.hold([body], holder + 1)
    board.write()
    assert vicinity.stale
    vicinity.look()
    assert world.m.body_contype[body]


def test_what_a_weld_joins_and_joined_is_woken() -> None:
    board, stock = a_board()
    m, d = stock.m, stock.d
    tree = {label: m.body_treeid[ids[0]] for label, ids in stock.body.items()}
    first = {label: m.body_dofadr[ids[0]] for label, ids in stock.body.items()}
    for label in ("part1", "part2"):
        d.tree_asleep[tree[label]] = tree[label]
        d.qvel[first[label] : first[label] + 6] = 0.0
    d.tree_asleep[tree["part3"]] = -1
    weld = stock.grip[0, "part1"]
    m.eq_obj2id[weld] = stock.body["part2"][0]
    holder = m.eq_obj1id[weld]
    joins = next(weld for (robot, label), weld in stock.grip.items() if robot and label == "part3")
    for name, body in (("holder", holder), ("other", m.eq_obj1id[joins])):
        tree[name], first[name] = m.body_treeid[body], m.body_dofadr[body]
        d.tree_asleep[tree[name]] = tree[name]
        d.qvel[first[name]] = 0.0
    board.loose([weld])
    board.join([weld], [int(stock.body["part1"][0])])
    board.join([stock.feed["part3"], joins], 2 * [int(stock.body["part3"][0])])
    board.write()
    for label, dofs in (("part1", 6), ("part2", 6), ("holder", 1), ("other", 1)):
        speeds = d.qvel[first[label] : first[label] + dofs]
        assert (speeds == 0.0).all() and (np.signbit(speeds) == np.signbit(AWAKE)).any()
    assert d.tree_asleep[tree["part3"]] == FRESH


@pytest.mark.parametrize(
    ("name", "given"), [("paper", {}), ("gearbox", {}), ("20", {}), ("20", {"fuse": True})]
)
def test_one_after_the_other_is_the_same(
    name: str, given: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """To the last bit."""
    at_once, singly = (Simulation(layout(name), RunRequest(units=4, **given)) for _ in range(2))
    expected = states(at_once, at_once.supervisor.step, 700)
    hand_over = Stock.hand_over

    def one_by_one(self: Stock, ended: Sequence[tuple[Operation, int]]) -> int:
        return sum(hand_over(self, [each]) for each in ended)

    monkeypatch.setattr(Stock, "hand_over", one_by_one)
    assert states(singly, singly.supervisor.step, 700) == expected
    one, other = at_once.world.inspection, singly.world.inspection
    assert one.handoffs == other.handoffs > 0
    assert one.gaps.largest() == other.gaps.largest() > 0.0
