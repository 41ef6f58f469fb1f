"""Whether a property fails as a certificate says: decided again from its listing, linearly."""

from __future__ import annotations

from collections.abc import Iterator

from factory.nets.certificate_net import Net, Section, number


def refute(net: Net, claim: str, section: Section) -> Iterator[str]:
    """The faults of a claim that the property `claim` fails."""
    if not section["reason"]:
        yield f"{claim}: fails without a reason"
    elif not _REFUTATIONS[claim](net, section):
        yield f"{claim}: the certificate does not show that it fails"


def _not_gear_net(net: Net, section: Section) -> bool:
    return not (composes(net) if net.gears else reduces(net))


def composes(net: Net) -> bool:
    """Whether the robots' gears compose a gear net: local conditions, then a tree by counting."""
    if not all(net.closed(robot) for robot in range(len(net.gears))):
        return False
    owners: list[list[int]] = [[] for _ in net.names]
    passing = [0] * len(net.events)
    for robot, (gear, turns) in enumerate(zip(net.gears, net.turns, strict=True)):
        for p, e in zip(gear, turns, strict=True):
            owners[p].append(robot)
            passing[e] += 1
    if not all(owners) or not all(passing) or not _robots_fit(net, owners):
        return False
    shared = [p for p, own in enumerate(owners) if len(own) > 1]
    joints = [e for p in shared for e in (net.left[p][0], net.right[p][0])]
    if len(set(joints)) < len(joints) or {e for e, n in enumerate(passing) if n > 1} != set(joints):
        return False
    if any(passing[net.left[p][0]] != len(owners[p]) for p in shared):
        return False
    if any(passing[net.right[p][0]] != len(owners[p]) for p in shared):
        return False
    return _is_tree(len(net.gears), [owners[p] for p in shared])


def _robots_fit(net: Net, owners: list[list[int]]) -> bool:
    """Whether slots are the gears', and no event moves a robot into another's slot."""
    if not all(net.fits(p, own) for p, own in enumerate(owners)):
        return False
    for event, moves in enumerate(net.moves):
        if moves is None:
            continue
        pairs = [((p, i), (q, j)) for p, i, q, j in moves]
        here = sorted((p, i) for p in net.preset[event] for i in range(len(net.slots[p])))
        there = sorted((q, j) for q in net.postset[event] for j in range(len(net.slots[q])))
        if sorted(x for x, _ in pairs) != here or sorted(y for _, y in pairs) != there:
            return False
        if any(net.slots[p][i] != net.slots[q][j] for (p, i), (q, j) in pairs):
            return False
    return True


def _is_tree(gears: int, shared: list[list[int]]) -> bool:
    """Whether gears and shared places form a tree: connected, with one edge less than nodes."""
    find = _Sets(gears)
    for own in shared:
        for gear in own[1:]:
            if not find.join(own[0], gear):
                return False
    return find.count == 1


class _Sets:
    """Disjoint sets of numbers."""

    def __init__(self, size: int) -> None:
        self.parent, self.count = list(range(size)), size

    def root(self, x: int) -> int:
        while self.parent[x] != x:
            self.parent[x] = self.parent[self.parent[x]]
            x = self.parent[x]
        return x

    def join(self, x: int, y: int) -> bool:
        """Join two sets; False where they were one."""
        x, y = self.root(x), self.root(y)
        self.parent[x] = y
        self.count -= x != y
        return x != y


def reduces(net: Net) -> bool:
    """Whether a net without robots is a gear net: with shared places contracted, replacing nodes
    with one way in and one way out, and dropping loops, leaves a single node."""
    edges = [net.edge(p) for p in range(len(net.names))]
    if not edges or None in edges or any(edge and edge[0] == edge[1] for edge in edges):
        return False
    node = list(range(len(net.events)))
    joint = set()
    for event, before in enumerate(net.preset):
        after = net.postset[event]
        if not before or not after or (len(before) > 1 and len(after) > 1):
            return False
        if len(before) > 1:
            far = net.right[after[0]][0]
            if len(net.preset[far]) != 1 or len(net.postset[far]) != len(before):
                return False
            node[far] = event
            joint.add(after[0])
        if len(after) > 1 and len(net.preset[net.left[before[0]][0]]) != len(after):
            return False
    kept = [(node[e[0]], node[e[1]]) for p, e in enumerate(edges) if e and p not in joint]
    return _series(set(node), kept)


def _series(nodes: set[int], edges: list[tuple[int, int]]) -> bool:
    """The reduction itself; each edge is touched a bounded number of times."""
    out: dict[int, set[int]] = {n: set() for n in nodes}
    into: dict[int, set[int]] = {n: set() for n in nodes}
    ends = list(edges)
    loops = [number_ for number_, (x, y) in enumerate(ends) if x == y]
    for index, (x, y) in enumerate(ends):
        if x != y:
            out[x].add(index)
            into[y].add(index)
    ready = list(nodes)
    left = len(ends) - len(loops)
    while ready and len(nodes) > 1:
        x = ready.pop()
        if x not in nodes or len(out[x]) != 1 or len(into[x]) != 1:
            continue
        before, after = next(iter(into[x])), next(iter(out[x]))
        start, goal = ends[before][0], ends[after][1]
        nodes.discard(x)
        into[goal].discard(after)
        left -= 1
        if start == goal:
            out[start].discard(before)
            left -= 1
            ready.append(start)
        else:
            ends[before] = (start, goal)
            into[goal].add(before)
    return len(nodes) == 1 and left == 0


def _not_legal(net: Net, section: Section) -> bool:
    """Whether some gear is not marked once, or a marked place acts on others than start there."""
    return not (all(map(net.marked_once, range(len(net.gears)))) and net.threaded())


def _not_safe(net: Net, section: Section) -> bool:
    tokens = play(net, section["firing"])
    return tokens is not None and tokens[number(section["place"])] >= 2


def _not_live(net: Net, section: Section) -> bool:
    """A circuit that is never marked, a place that nothing marks, or a deadlock."""
    circuit = section["circuit"]
    if circuit is None:
        tokens = play(net, section["firing"])
        return tokens is not None and not any(enabled(net, tokens, e) for e in events(net))
    if len(circuit) == 1 and not net.left[circuit[0]]:
        return bool(net.right[circuit[0]])
    loop = len(circuit) == 1
    return net.circuit(circuit) and (loop or not any(net.tokens[p] for p in circuit))


def _not_reversible(net: Net, section: Section) -> bool:
    """A deadlock that is not the start, or a transition of a marked graph that can fire next to
    one that can do so a bounded number of times only."""
    if section["firing"] is not None:
        tokens = play(net, section["firing"])
        stop = tokens is not None and not any(enabled(net, tokens, e) for e in events(net))
        return stop and len(section["firing"]) > 0
    first = number(section["transition"])
    return net.marked_graph() and first in one_way(net)


def one_way(net: Net) -> list[int]:
    """The enabled transitions of a marked graph in a component where something fires finitely
    often: then everything in it does. Without any, the net is reversible: components where all
    goes on return (Murata 1989, Theorem 21), and in the others nothing ever happens."""
    sets = _Sets(len(net.events))
    for before, after in zip(net.left, net.right, strict=True):
        if before and after:
            sets.join(before[0], after[0])
    finite = {sets.root(e) for e in _stuck(net)}
    for before, after in zip(net.left, net.right, strict=True):
        if not before or not after:
            finite.update(sets.root(e) for e in before + after)
    return [e for e in events(net) if sets.root(e) in finite and enabled(net, net.tokens, e)]


def _stuck(net: Net) -> list[int]:
    """The transitions of a marked graph that never fire: those that no order of the token-free
    places reaches."""
    waits = [0] * len(net.events)
    free = [
        not tokens or bool(set(net.left[p]) & set(net.right[p]))
        for p, tokens in enumerate(net.tokens)
    ]
    for p, after in enumerate(net.right):
        if free[p] and after:
            waits[after[0]] += 1
    ready = [e for e, count in enumerate(waits) if not count]
    for event in ready:
        for p in net.postset[event]:
            if free[p] and net.right[p]:
                waits[net.right[p][0]] -= 1
                if not waits[net.right[p][0]]:
                    ready.append(net.right[p][0])
    return [e for e, count in enumerate(waits) if count]


def events(net: Net) -> range:
    """The numbers of the transitions."""
    return range(len(net.events))


def enabled(net: Net, tokens: list[int], event: int) -> bool:
    """Whether a transition can fire; one with a place before and after it never can."""
    before = net.preset[event]
    return all(tokens[p] for p in before) and not set(before) & set(net.postset[event])


def play(net: Net, firing: list[int]) -> list[int] | None:
    """The tokens after a firing sequence, None where it cannot fire."""
    tokens = list(net.tokens)
    for event in firing:
        if not enabled(net, tokens, number(event)):
            return None
        for p in net.preset[event]:
            tokens[p] -= 1
        for p in net.postset[event]:
            tokens[p] += 1
    return tokens


_REFUTATIONS = {
    "gear_net": _not_gear_net,
    "safe": _not_safe,
    "live": _not_live,
    "reversible": _not_reversible,
    "legal": _not_legal,
}
