"""Whether a clearance certificate holds: what is wrong with it, by the names of machines.

A certificate holds if its places are those of the net; if each body with a joint has ways, within
the ranges of its joints and up to their ends; if each machine is in one of its ways in every
marking and comes to the next without a jump, with the parts that it holds; if none comes near what
stands; and if any two ways of different machines, in different places, that come near are excluded
by a circuit of the net that goes through a place of both and carries one token.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations

from factory.apps.exports.clearance.documents import ClearanceProof, ExcludedPair, MachineWay
from factory.apps.exports.clearance.machines import Machines
from factory.apps.exports.clearance.moving import (
    Machine,
    MachineStep,
    PartTransfers,
    hulls,
    jumps,
    starts_outside,
)
from factory.apps.exports.clearance.sweeping import TOUCHING, Sweeping

PLAY = 0.125
"""The stops of a joint begin to act no further beyond its ways than this share of the distance over
which they act."""

EXACT = 1e-6
"""Figures that are rounded agree within this [m or rad]."""


def faults_of(proof: ClearanceProof) -> list[str]:
    """What is wrong, in the order in which it is looked for; [] where the certificate holds. What
    names things that are not there is refused before anything is swept."""
    machines = Machines(proof.model)
    named = [*_places(proof), *_names(proof, machines)]
    if named:
        return named
    return [
        *_bodies(proof, machines),
        *_ranges(proof, machines),
        *_moves(proof, machines),
        *_pairs(proof, machines),
    ]


def _places(proof: ClearanceProof) -> Iterator[str]:
    """Places that the ways refer to are those of the net, with their tokens."""
    seen = set[str]()
    for name, row in proof.net.items():
        if row.before == row.after:
            yield f"place '{name}' is from '{row.before}' to the same: it says nothing"
    for name, row in proof.places:
        if name in seen:
            yield f"two places are called '{name}'"
        seen.add(name)
        of_net = proof.net.get(name)
        if of_net is None:
            yield f"place '{name}' is not of the net"
        elif of_net != row:
            yield (
                f"place '{name}' is from '{row.before}' to '{row.after}' with {row.tokens} tokens;"
                f" in the net from '{of_net.before}' to '{of_net.after}' with {of_net.tokens}"
            )
    yield from (f"place '{name}' of the net is left out" for name in proof.net if name not in seen)


def _names(proof: ClearanceProof, machines: Machines) -> Iterator[str]:
    """Ways name what is in the model and in the net, of one machine."""
    trees, called = dict[str, set[int]](), dict[int, set[str]]()
    for way in proof.ways:
        unknown = (
            *(f"place '{p}' is not of the net" for p in way.places if p not in proof.net),
            *(f"there is no body '{b}'" for b in way.bodies if b not in machines.bodies),
            *(f"there is no joint '{j}'" for j in way.joints if j not in machines.joints),
            *(f"weld '{w}' holds no part" for w in way.welds if w not in machines.holders),
        )
        yield from (f"{way}: {fault}" for fault in unknown)
        if unknown:
            continue
        roots = {machines.root(machines.bodies[body]) for body in way.bodies} - {0}
        trees.setdefault(way.machine, set()).update(roots)
        for root in roots:
            called.setdefault(root, set()).add(way.machine)
        if len(roots) != 1 or not way.places:
            yield f"{way}: it has {len(roots)} moving machines in {len(way.places)} places"
            continue
        (root,) = roots
        if sorted(way.joints) != sorted(machines.joints_of[root]):
            listed = ", ".join(machines.joints_of[root])
            yield f"{way}: its joints are not those of '{machines.name(root)}': {listed}"
        lacking = [b for b in machines.bodies_of(root) if b not in way.bodies]
        if lacking:
            yield f"{way}: body '{lacking[0]}' is left out"
        if any(machines.holders[weld] != root for weld in way.welds):
            yield f"{way}: it holds by a weld of another machine"
        if not way.spans or any(len(group) != len(way.joints) for group in way.spans):
            yield f"{way}: it has not one span for each joint"
    for name, roots in trees.items():
        if len(roots) > 1:
            listed = " and ".join(machines.name(root) for root in sorted(roots))
            yield f"{len(roots)} machines are called '{name}': {listed}"
    for root, names in called.items():
        if len(names) > 1:
            yield f"'{machines.name(root)}' is called {' and '.join(sorted(names))}"


def _bodies(proof: ClearanceProof, machines: Machines) -> Iterator[str]:
    """Each body with a joint has ways, and each weld is in one of them."""
    joints = {joint for way in proof.ways for joint in way.joints}
    welds = {weld for way in proof.ways for weld in way.welds}
    for root, of_root in machines.joints_of.items():
        if joints.isdisjoint(of_root):
            yield f"'{machines.name(root)}' has joint '{of_root[0]}', and no ways"
    for weld in machines.holders:
        if weld not in welds:
            part = machines.name(machines.part(weld))
            yield f"weld '{weld}' holds '{part}' on no way of its machine"


def _ranges(proof: ClearanceProof, machines: Machines) -> Iterator[str]:
    """The ways of each joint are within its range, and go up to its stops."""
    m = machines.m
    for joint, (begin, end) in hulls(proof.ways).items():
        number = machines.joints[joint]
        margin = float(m.jnt_margin[number])
        if not m.jnt_limited[number] or margin > proof.clearance:
            yield f"joint '{joint}' has no stops within the clearance of {proof.clearance:g} m"
            continue
        low, high = (float(end) for end in m.jnt_range[number])
        if begin < low - EXACT or end > high + EXACT:
            yield f"joint '{joint}' may go {low:g} to {high:g}; its ways are {begin:g} to {end:g}"
        elif max(begin - low, high - end) - margin > PLAY * margin + EXACT:
            yield (
                f"joint '{joint}' may go {low + margin:g} to {high - margin:g}, beyond its ways:"
                f" {begin:g} to {end:g}"
            )


def _moves(proof: ClearanceProof, machines: Machines) -> Iterator[str]:
    """Each machine is always in one of its ways, and jumps nowhere; parts change hands."""
    steps, level = list[MachineStep](), machines.carriages()
    for of_machine in proof.by_machine.values():
        machine = Machine(of_machine, proof.net)
        at_start = [way for way in of_machine if _starts(machines, way)]
        faults = dict[str, None]()
        for step in machine.explore():
            if isinstance(step, str):
                yield f"{machine.name} {step}"
                continue
            steps.append(step)
            faults |= dict.fromkeys([*jumps(step, at_start), *starts_outside(step, level)])
        yield from faults
    yield from PartTransfers.of(steps, machines).faults()


def _starts(machines: Machines, way: MachineWay) -> bool:
    """Whether the model starts on a way."""
    m = machines.m
    at = [float(m.qpos0[m.jnt_qposadr[machines.joints[joint]]]) for joint in way.joints]
    return any(
        all(low - EXACT <= x <= high + EXACT for x, (low, high) in zip(at, group, strict=True))
        for group in way.spans
    )


def _pairs(proof: ClearanceProof, machines: Machines) -> Iterator[str]:
    """Machines that come near are excluded by a circuit; what stands they never come near."""
    apart = set[tuple[str, ...]]()
    for pair in proof.excluded:
        if reason := _circuit(proof, pair):
            yield f"{' and '.join(pair.machines)}: {reason}"
        else:
            apart.update([pair.places, pair.places[::-1]])
    gears = {name: Machine(ways, proof.net) for name, ways in proof.by_machine.items()}

    def alike(one: MachineWay, other: MachineWay) -> bool:
        """Whether the machines go through the same places, one after the other."""
        mine, its = gears[one.machine], gears[other.machine]
        return mine.places == its.places and mine.is_gear

    sweeping = Sweeping(machines)
    swept = [(way, sweeping.swept(way)) for way in proof.ways]
    standing = sweeping.standing({body for way in proof.ways for body in way.bodies})
    for way, mine in swept:
        moving = tuple(b for b in way.bodies if machines.root(machines.bodies[b]))
        if moving != way.bodies:
            mine = sweeping.swept(replace(way, bodies=moving))
        if geoms := mine.near(standing, TOUCHING):
            yield f"{way}: {geoms[0]} comes near {geoms[1]}, which stands"
    for (one, mine), (other, its) in combinations(swept, 2):
        if one.machine == other.machine or {*one.places} & {*other.places}:
            continue
        geoms = mine.near(its)
        both = ((p, q) for p in one.places for q in other.places)
        if geoms and apart.isdisjoint(both) and not alike(one, other):
            sides = zip(geoms, (one, other), strict=True)
            words = " and ".join(f"{geom} in {' and '.join(w.places)}" for geom, w in sides)
            names = f"{one.machine} and {other.machine}"
            yield f"{names}: {words} come near, and no circuit excludes that"


def _circuit(proof: ClearanceProof, pair: ExcludedPair) -> str:
    """Why a circuit does not exclude a pair, "" if it does."""
    net, listed = proof.net, ", ".join(pair.circuit)
    if not all(name in net for name in (*pair.circuit, *pair.places)):
        return f"its circuit is not of the net: {listed}"
    if len(pair.places) != 2 or pair.places[0] == pair.places[1]:
        return f"it has not two places, but {' and '.join(pair.places)}"
    if not {*pair.places} <= {*pair.circuit}:
        return f"its circuit is not through {' and '.join(pair.places)}"
    onward = (*pair.circuit[1:], *pair.circuit[:1])
    for here, then in zip(pair.circuit, onward, strict=True):
        if net[here].after != net[then].before:
            return f"its circuit breaks between {here} and {then}"
    tokens = sum(net[name].tokens for name in pair.circuit)
    return "" if tokens == 1 else f"its circuit carries {tokens} tokens: {listed}"
