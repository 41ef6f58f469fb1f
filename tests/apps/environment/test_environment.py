"""A factory as a Gymnasium environment: its checker, the baseline, and agents by chance."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import factory
from factory.apps.environment.plant import FactoryEnv
from factory.apps.environment.programs import Programs
from factory.apps.plc.corridors import Corridors
from tests.paths import ROOT


def env_of(name: str, **how: Any) -> FactoryEnv:
    made = factory.env(ROOT / "examples" / f"{name}.pag", **how)
    assert isinstance(made, FactoryEnv)
    return made


def episode(env: FactoryEnv, seed: int) -> tuple[float, list[str], dict[str, Any]]:
    """The reward of an episode by the baseline, what was refused, and the last info."""
    seen, info = env.reset(seed=seed)
    agent, paid, refused, over = Programs(env), 0.0, list[str](), False
    while not over:
        action = agent.act(seen, info["time"])
        assert env.action_space.contains(action)
        seen, reward, ended, cut_off, info = env.step(action)
        assert env.observation_space.contains(seen)
        paid, over = paid + reward, ended or cut_off
        refused += info["refused"]
    return paid, refused, info


def test_the_baseline_makes_all_units() -> None:
    paid, refused, info = episode(env_of("paper", units=2, jitter=0.3, interval=0.05), 5)
    assert (paid, refused, info["products"], info["tripped"]) == (2.0, [], 2, False)


def test_legal_jobs_are_not_refused_and_others_are() -> None:
    """One robot at a time takes up or gives up a job, drawn by chance; grips follow the baseline,
    so what is refused is the job."""
    seed = 2
    env, rng = env_of("paper", units=2, interval=0.05), np.random.default_rng(seed)
    seen, info = env.reset(seed=seed)
    agent, tried = Programs(env), {True: 0, False: 0}
    for _ in range(60):
        action = agent.act(seen, info["time"])
        changed = np.flatnonzero(action["job"] != seen["job"])
        action["job"] = seen["job"].copy()
        robot = int(rng.choice(changed)) if len(changed) else int(rng.integers(6))
        job = int(rng.integers(env.action_space["job"].nvec[robot]))
        legal = bool(seen["legal"][robot, job])
        if seen["job"][robot] and job:  # it gives its job up first
            job, legal = 0, bool(seen["legal"][robot, 0])
        tried[legal] += job != seen["job"][robot]
        action["job"][robot] = job
        action["grip"] = np.array(env.simulation.supervisor.interlock.commands.grip, np.int8)
        seen, *_, info = env.step(action)
        assert bool(info["refused"]) == (not legal), (robot, job, info["refused"])
    assert tried[False], "nothing illegal was tried"


def test_the_plant_looks_every_tick(monkeypatch: pytest.MonkeyPatch) -> None:
    """However seldom it is commanded: where it looked at each command only, a robot that was home
    for an instant in between was moved on, and its next part came down on its hand."""
    env, times, bounds = env_of("paper", interval=0.1), list[float](), Corridors.bounds

    def looked(self: Corridors, *state: Any) -> Any:
        times.append(env.simulation.world.time)
        return bounds(self, *state)

    env.reset(seed=0)
    monkeypatch.setattr(Corridors, "bounds", looked)
    env.step(env.action_space.sample())
    assert len({round(time, 3) for time in times}) > 10


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ({"render_mode": "human"}, "rgb_array"),
        ({"interval": 0.0}, "0 < interval < max_time"),
        ({"worlds": 0}, "give 1 or more"),
        ({"units": 0}, "units"),
    ],
)
def test_what_cannot_be_is_named(how: dict[str, Any], words: str) -> None:
    with pytest.raises(factory.InputError, match=words):
        factory.env(ROOT / "examples" / "paper.pag", **how)
