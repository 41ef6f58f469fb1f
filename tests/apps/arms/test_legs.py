"""Legs are clear or say what blocked them; the configurations of a circuit are the best."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from factory.apps.arms import planning
from factory.apps.arms.joint_way import JointWay
from factory.apps.arms.planning import ArmPlanner


@pytest.mark.parametrize(
    ("label", "held"), [("lid", [True, True, False]), ("", [False, True, False])]
)
def test_a_part_counts_until_it_is_over_its_place(
    label: str, held: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is judged with the arm while the arm takes it up and on the way, at its place no more."""
    asked = list[Any]()
    way = JointWay(np.linspace(0.0, 1.0, 5), np.zeros((5, 2)), 0.1, 0.8)
    planner: Any = ArmPlanner.__new__(ArmPlanner)
    planner.chain = SimpleNamespace(bodies=[])
    planner.scene = SimpleNamespace(margins=lambda q, label, need, spared, held: held)
    burden = SimpleNamespace(onto=0, source=1, join=None, takes=None, comes=(0, 0, 1))
    planner.cell = SimpleNamespace(burdens=dict.fromkeys(("lid", "tub"), burden))
    planner.pace, planner._moving = None, frozenset()
    for name in ("_have", "_carried", "_spared_at", "_spared_under"):
        monkeypatch.setattr(ArmPlanner, name, lambda *_: set())
    monkeypatch.setattr(planning, "leg", lambda *_, **__: way)

    def certify(
        chain: object, way: JointWay, stretch: object, bodies: object, margins: Any
    ) -> None:
        asked.append((stretch, margins(q=way.places)))

    monkeypatch.setattr(planning, "uncertified", certify)
    end = SimpleNamespace(rows=np.zeros((2, 2)), share=0.1)
    assert planner._leg(end, end, label, "tub", "lid") is way
    assert [stretch for stretch, _ in asked] == [(0.0, 0.1), (0.1, 0.8), (0.8, 1.0)]
    assert [counts for _, counts in asked] == held
