"""Domains of attraction: each mode alone, in physics, from starts drawn in the D_p that it claims.

A mode claims what its field and the certificate claim together: W - Δ, as far as the certificate
has its robots there while the mode's place is marked. (Hands and parts are as large as they are:
further out in W, a hand may be where something else stands, and no run brings it there.) A start is
drawn inside and on the borders: at the ends of the ways, next to Δ (robots that all but touch), at
the corner and along the edges of the L that a gate makes of W. The robots of the mode are put there
in the engine, parts in their hands; the rest of the factory stands where it is when the mode starts
for the first unit. The goal is reached when all are in the goal ball, at rest, the clock run out,
before `patience`. A claimed start from which it is not, or on whose way there is a contact, is a
defect. A start that has a contact to begin with is one too, counted apart: no factory can be
there."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benches.fidelity.products import CAMPAIGN, layout, over_cores
from benches.tables import table
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.exclusions import awaited_positions, coordinated
from factory.floor.layout.layout import Layout
from factory.floor.layout.machines import presences
from factory.floor.layout.presence import ROUNDING, Span
from factory.support.arrays import Array, Index
from factory.support.engine import mujoco
from factory.theory.control.mode import REST
from factory.theory.control.navigation import Bundle
from factory.theory.nets.petri import Marking
from tests.token_game import enabled, follower

KINDS = ("inside", "stop", "touching", "gate")

CLOSE = 1e-3
"""`touching` is within this of Δ [m]."""

DEEP = 1e-3
"""Parts that are being joined may touch, but at the start they are in each other no deeper [m]."""

KEPT = 5
"""Defects that are kept of each mode."""


@dataclass(frozen=True)
class Outcome:
    """One start x [m], the kind of place it is, and what came of it: `reached`, `missed`, `contact`
    on the way or `overlap` at the start; `seconds` [s] it took, and the geoms that touched."""

    start: tuple[float, ...]
    kind: str
    result: str
    seconds: float
    contacts: tuple[tuple[str, str], ...] = ()


class Claim:
    """Where the certificate has the robots of a mode while its place is marked: for each of its
    axes the spans [m], of which those of a robot and its lift go together."""

    def __init__(self, plan: Layout, number: int, axes: Index) -> None:
        operation, up = plan.factory.operations[number], plan.factory.up
        net = coordinated(plan)
        # A magazine shows the part only once its robot has passed out of the slider's way.
        served = number in net.served
        before = {place for place, _ in net.passes.values()} if served else set[int]()
        column = {int(axis): n for n, axis in enumerate(axes)}
        spans: dict[int, list[tuple[Span, Span]]] = {}
        for presence in presences(plan, net, awaited_positions(plan)):
            here = operation.place in presence.places and before.isdisjoint(presence.places)
            if here and not presence.bears:
                spans.setdefault(presence.robot, []).extend(presence.sweeps)
        self.columns = [
            (column[r], None if (a := up(r)) is None else column.get(a)) for r in operation.robots
        ]
        self.spans = [spans[r] for r in operation.robots]

    def draw(self, chance: np.random.Generator, size: int, at_ends: bool) -> Array:
        """A place drawn in it; `at_ends`: one robot is at an end of its way, and others may be."""
        x = np.zeros(size)
        pinned = chance.integers(len(self.spans))
        for robot, (columns, spans) in enumerate(zip(self.columns, self.spans, strict=True)):
            chosen = spans[chance.integers(len(spans))]
            end = at_ends and (robot == pinned or chance.random() < 2 / 3)
            for column, span in zip(columns, chosen, strict=True):
                if column is not None:
                    x[column] = chance.choice(span) if end else chance.uniform(*sorted(span))
        return x

    def holds(self, x: Array) -> bool:
        """Whether a place is in it, to a rounding."""
        return all(
            any(
                all(
                    column is None or min(span) - ROUNDING <= x[column] <= max(span) + ROUNDING
                    for column, span in zip(columns, pair, strict=True)
                )
                for pair in spans
            )
            for columns, spans in zip(self.columns, self.spans, strict=True)
        )


class Bench:
    """One operation's mode in the engine, alone, to be started from anywhere in its domain."""

    def __init__(self, plan: Layout, number: int) -> None:
        self.simulation = Simulation(plan, RunRequest(units=2, start=marking_at(plan, number)))
        supervisor = self.simulation.supervisor
        assert supervisor.active.operations == (number,)
        assert supervisor.active.bundle is not None
        self.world, self.axes = self.simulation.physical, supervisor.active.axes
        self.bundle: Bundle = supervisor.active.bundle
        self.mode = self.bundle.modes[0]
        self.claim = Claim(plan, number, self.axes)
        self.world.apply([(plan.factory.operations[number], 0)], [])
        self.tick = self.simulation.request.settings.tick
        self.kept = mujoco.MjData(self.world.m)
        mujoco.mj_copyData(self.kept, self.world.m, self.world.d)
        m = self.world.m  # which drives keep samples is in the model
        self.samples = m.actuator_delay.copy(), m.actuator_history.copy()

    @property
    def patience(self) -> float:
        """How long a start is given [s]: twice the way through the whole of W at the speed limit,
        the dwell and 3 s."""
        way = (self.mode.upper - self.mode.lower) / self.bundle.speed
        return float(2 * way.sum() + self.mode.dwell + 3.0)

    def put(self, x: Array) -> list[tuple[str, str]]:
        """The robots at x, at rest, with what they hold; gives the geoms that touch there
        and should not."""
        world, m, d = self.world, self.world.m, self.world.d
        mujoco.mj_copyData(d, m, self.kept)
        m.actuator_delay[:], m.actuator_history[:] = self.samples
        world.inspection.tick()
        still = np.zeros(len(x))
        d.qpos[world.motion.axes.qpos[self.axes]] = x
        world.move(self.axes, x, still, still)
        mujoco.mj_kinematics(m, d)
        for weld in np.flatnonzero(d.eq_active):
            if m.equality(weld).name.startswith("grip/"):
                holder, part = m.eq_obj1id[weld], m.eq_obj2id[weld]
                at = m.jnt_qposadr[m.body_jntadr[part]]
                turn = d.xmat[holder].reshape(3, 3)
                d.qpos[at : at + 3] = d.xpos[holder] + turn @ m.eq_data[weld, 3:6]
        d.qvel[d.qvel == 0.0] = -0.0
        mujoco.mj_forward(m, d)
        seen = len(world.inspection.unintended)
        world.inspection.contacts()
        deep = d.contact.geom[: d.ncon][d.contact.dist[: d.ncon] < -DEEP]
        inside = [(m.geom(a).name, m.geom(b).name) for a, b in deep]
        return list(dict.fromkeys([*world.inspection.unintended[seen:], *inside]))

    def reach(self, x: Array, kind: str = "inside") -> Outcome:
        """The mode from x until its goal, or until patience is at its end."""
        start = tuple(float(value) for value in x)
        if touching := self.put(x):
            return Outcome(start, kind, "overlap", 0.0, tuple(touching))
        world, begun = self.world, self.world.time
        axes = self.axes.copy()  # other axes than before: the mode begins anew
        seen, clock = len(world.inspection.unintended), np.zeros(1)
        result = "missed"
        while world.time - begun < self.patience:
            world.step(self.bundle, axes)
            q, v = (sensed[axes] for sensed in world.sense())
            there = self.bundle.at_goal(q)
            clock += self.tick * there
            if self.bundle.finished(there, clock)[0] and (np.abs(v) < REST).all():
                result = "reached"
                break
        touched = tuple(dict.fromkeys(world.inspection.unintended[seen:]))
        if touched:
            result = "contact"
        return Outcome(start, kind, result, round(world.time - begun, 6), touched)


def marking_at(plan: Layout, number: int) -> Marking:
    """The marking where, for the first unit, all that an operation needs is done and it has just
    started."""
    factory, net = plan.factory, plan.factory.net
    wanted = {o.index for o in factory.operations if _within(plan, o.index, number)}
    events = {e for o in wanted for e in (factory.operations[o].start, factory.operations[o].end)}
    events.remove(factory.operations[number].end)
    marking = net.initial_marking
    while events:
        event = next(e for e in enabled(net.threaded.net, marking) if e in events)
        marking = follower(net.threaded.net, marking, [event])
        events.remove(event)
    return marking


def _within(plan: Layout, operation: int, number: int) -> bool:
    """Whether an operation is `number` or makes something for it."""
    factory = plan.factory
    while operation != number and operation != factory.dropoff.index:
        operation = factory.parents[operation]
    return operation == number


def draw(bench: Bench, chance: np.random.Generator, kind: str) -> Array | None:
    """A start of a kind in the domain that a bench's mode claims; None where it has no such
    place."""
    mode, bundle = bench.mode, bench.bundle
    gated = np.flatnonzero(mode.gate >= 0)
    if (kind == "gate" and not len(gated)) or (kind == "touching" and not len(mode.pairs)):
        return None
    for _ in range(1000):
        x = bench.claim.draw(chance, mode.size, kind == "stop")
        if kind == "touching":
            _close_in(bundle, x, chance)
        elif kind == "gate":
            robot = int(chance.choice(gated))
            if chance.random() < 0.5:
                x[robot] = mode.goals[robot] + mode.standoff[robot]
            else:
                gate = mode.gate[robot]
                x[gate] = mode.goals[gate] + chance.uniform(-0.7, 0.7) * mode.eps
        if bench.claim.holds(x) and bundle.in_domain(x)[0]:
            return x
    return None


def _close_in(bundle: Bundle, x: Array, chance: np.random.Generator) -> None:
    """Bring a pair to within CLOSE of touching, on random sides of their meeting point."""
    mode = bundle.modes[0]
    pair = int(chance.integers(len(mode.pairs)))
    (i, j), (at_i, at_j) = mode.pairs[pair], mode.meet[pair]
    apart = mode.touch[pair] + chance.uniform(0, CLOSE)
    share = chance.uniform()
    side_i, side_j = chance.choice([-1, 1], size=2)
    x[i], x[j] = at_i + side_i * share * apart, at_j + side_j * (1 - share) * apart


def try_mode(plan: Layout, number: int, count: int, seed: int = 0) -> list[Outcome]:
    """`count` starts of each kind that an operation's mode has."""
    bench, chance = Bench(plan, number), np.random.default_rng([seed, number])
    outcomes = []
    for kind in KINDS:
        for _ in range(count):
            x = draw(bench, chance, kind)
            if x is not None:
                outcomes.append(bench.reach(x, kind))
    return outcomes


def chosen(plan: Layout) -> list[int]:
    """One operation of each template and pattern of gates in a factory."""
    found: dict[tuple[str, bool], int] = {}
    simulation = Simulation(plan, RunRequest(units=1))
    for operation in plan.factory.operations:
        gated = bool((simulation.modes[operation.index].gate >= 0).any())
        found.setdefault((operation.template.name, gated), operation.index)
    return sorted(found.values())


def measure(quick: bool = False) -> dict:
    """Starts in the domain of one mode of each template of each product."""
    count = 5 if quick else 20
    products = CAMPAIGN[:1] if quick else CAMPAIGN
    cases = [(name, number, count) for name in products for number in chosen(layout(name))]
    return {"starts_of_each_kind": count, "modes": over_cores(tried, cases)}


def tried(case: tuple[str, int, int]) -> dict:
    """What came of an operation's mode, by the name of its product and its number, from so many
    starts of each kind."""
    name, number, count = case
    plan = layout(name)
    operation = plan.factory.operations[number]
    outcomes = try_mode(plan, number, count)
    return summary(name, operation.template.name, operation.label, outcomes)


def summary(product: str, template: str, label: str, outcomes: Sequence[Outcome]) -> dict:
    """What the starts of one mode came to; a `defect` is any but `reached`."""
    defects = [o for o in outcomes if o.result != "reached"]
    touched = Counter(" - ".join(_kinds(c)) for o in defects for c in o.contacts)
    return {
        "product": product,
        "template": template,
        "label": label,
        "starts": len(outcomes),
        "results": dict(Counter(o.result for o in outcomes)),
        "defects_by_kind": dict(Counter(o.kind for o in defects)),
        "starts_by_kind": dict(Counter(o.kind for o in outcomes)),
        "share_reached": (len(outcomes) - len(defects)) / len(outcomes) if outcomes else None,
        "longest_s": max((o.seconds for o in outcomes if o.result == "reached"), default=None),
        "touched": dict(touched.most_common()),
        "defects": [
            {"start": o.start, "kind": o.kind, "result": o.result, "contacts": o.contacts}
            for o in defects[:KEPT]
        ],
    }


def _kinds(pair: tuple[str, str]) -> tuple[str, ...]:
    """Two geoms without the numbers of copies."""
    return tuple(sorted(name.partition("#")[0] for name in pair))


def section(results: dict) -> str:
    """The report."""
    head = ("product", "mode", "starts", "reached", "missed", "contact", "overlap at the start")
    rows = [
        (
            m["product"],
            f"{m['template']}({m['label']})",
            m["starts"],
            f"{100 * m['share_reached']:.1f} %" if m["starts"] else None,
            *(m["results"].get(result, 0) for result in ("missed", "contact", "overlap")),
        )
        for m in results["modes"]
    ]
    faults = [m for m in results["modes"] if m["defects_by_kind"]]
    lines = [
        f"* `{m['product']}` {m['template']}({m['label']}): "
        + ", ".join(
            f"{bad} of {m['starts_by_kind'][kind]} starts {kind}"
            for kind, bad in m["defects_by_kind"].items()
        )
        + ("; touched: " + ", ".join(m["touched"]) if m["touched"] else "")
        for m in faults
    ]
    total = sum(m["starts"] for m in results["modes"])
    bad = sum(sum(m["defects_by_kind"].values()) for m in results["modes"])
    return "\n\n".join(
        [
            "## Domains of attraction",
            f"Each mode alone in MuJoCo from {results['starts_of_each_kind']} starts of each kind"
            " in the D_p that it claims, which is W - Δ as far as the certificate has its robots"
            " there: inside, at the ends of ways, within 1 mm of Δ, at the edges that gates make."
            " Reached: in the goal ball and at rest, the clock run out, without a contact, within"
            " twice the time for the whole of W, the dwell and 3 s.",
            table(head, rows),
            f"**{total} starts, {bad} defects.**" + (" Where:" if lines else ""),
            *(["\n".join(lines)] if lines else []),
        ]
    )
