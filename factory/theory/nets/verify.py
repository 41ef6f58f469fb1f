"""The proof that a net is a gear net or a gear train, live, safe, reversible and legally marked, in
linear time.

Definitions 3.5 and 3.6 are checked gear by gear (`composition`), and 3.6' for a gear train
(`train`). Then every place lies on a gear, which is a circuit, and a legal marking gives each gear
one token: so the net is safe. It is live where the places without token can be put in an order,
each after those it waits for (Commoner et al. 1971, Theorem 1), and a live marked graph that
consists of circuits is reversible (Murata 1989, Theorem 21). Theorems 3.1 and 3.2 are not used, but
tested. `factory.apps.foreign_nets` decides the properties of nets that are not composed in this
way.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice

from factory.support.collector import collector_paused
from factory.support.errors import Diagnostic, Position, RunError, listing
from factory.theory.nets.composition import MOST, Composition, named
from factory.theory.nets.gears import GearNet
from factory.theory.nets.marked import MarkedNet
from factory.theory.nets.train import dead_train_defects, train_defects
from factory.theory.nets.verdict import Defect, Verdict


def proved(net: GearNet) -> Verdict:
    """The verdict on a net all of whose properties hold.

    Args:
        net: a gear net.

    Raises RunError (NotProved) with a witness for each that does not.
    """
    proof = verify(net)
    if not proof.holds:
        raise RunError(
            Diagnostic("NotProved", str(witness), None, "see factory check")
            for witness in proof.faults
        )
    return proof


@collector_paused()
def verify(net: GearNet | MarkedNet, sources: Mapping[str, Position] | None = None) -> Verdict:
    """Prove that a net is composed of its gears, and all that follows (Theorems 3.1, 3.2 and 5.1).
    Linear in the net.

    Args:
        net: a gear net, or a marked net with gears that are claimed.
        sources: source positions of robots by name, for the witnesses.

    Live, safe and reversible are undecided (None) where the claim or the marking fails.
    """
    return GearProof.of(net).verdict(sources)


@dataclass(frozen=True)
class GearProof:
    """What is known of a net by its gears, before its behaviour is.

    Attributes:
        subject: the net with its tokens.
        composition: its gears in the order in which they compose it, or the defects.
        against: the defects of a gear net or gear train, in its composition and in slots that
            change their robot.
        train: whether it is a gear train.
        illegal: the defects of the initial marking.
    """

    subject: MarkedNet
    composition: Composition
    against: tuple[Defect, ...]
    train: bool
    illegal: tuple[Defect, ...]

    @classmethod
    def of(cls, net: GearNet | MarkedNet) -> GearProof:
        """The proof of a net with gears. Linear."""
        subject = MarkedNet.of(net)
        composition = Composition.of(subject)
        moved = tuple(islice(_changed_slots(net), MOST)) if isinstance(net, GearNet) else ()
        untrained = train_defects(subject, composition)
        more = (defect for defect in untrained if defect.property == "gear_train")
        against = (*composition.defects, *moved, *more)
        illegal = tuple(islice(_illegal(net, subject), MOST))
        return cls(subject, composition, against, not untrained and not moved, illegal)

    def verdict(self, sources: Mapping[str, Position] | None) -> Verdict:
        """The verdict on the net (see `verify`)."""
        defects: Iterable[Defect] = ()
        if self.illegal or not self.train:
            text = "undecided: it is proved of gear nets with a legal marking only"
            defects = (Defect(name, "undecided", text) for name in ("live", "safe", "reversible"))
        elif stuck := self.subject.token_free.stuck:
            defects = dead_train_defects(self.subject, stuck)
        every = (*self.against, *defects, *self.illegal)
        return Verdict.of(self.subject, every, self.train, sources)


def _changed_slots(net: GearNet) -> Iterator[Defect]:
    """Events that move a robot into another robot's slot."""
    slots = net.slots
    for event, pairs in enumerate(net.threaded.redistribution):
        for (p, i), (q, j) in pairs:
            if i >= len(slots[p]) or j >= len(slots[q]) or slots[p][i] != slots[q][j]:
                names = net.threaded.places
                text = (
                    f"{net.threaded.transitions[event].name} moves slot {i + 1} of {names[p].name}"
                    f" to slot {j + 1} of {names[q].name}, which belongs to another robot"
                )
                yield Defect("gear_net", "slots", text, (), (p, q), (event,))


def _illegal(net: GearNet | MarkedNet, subject: MarkedNet) -> Iterator[Defect]:
    """Gears that are not marked exactly once, and reasons for which f_m is no bijection."""
    miscounted = tuple(_miscounted(subject))
    yield from miscounted
    if isinstance(net, GearNet) and len(net.initial) != len(net.gears):
        text = f"{len(net.initial)} initial places are given for {len(net.gears)} robots"
        kind = "lost token" if len(net.initial) < len(net.gears) else "doubled token"
        yield Defect("legal", kind, text)
    elif subject.slots and not miscounted:
        yield from _unthreaded(net, subject)


def _miscounted(subject: MarkedNet) -> Iterator[Defect]:
    """Gears that are not marked exactly once, and marked places in none."""
    tokens, names = subject.tokens, subject.net.places
    for number, gear in enumerate(subject.gears):
        on = [p for p in dict.fromkeys(gear.places) if tokens[p]]
        count = sum(tokens[p] for p in on)
        if count == 0:
            text = f"the gear of {gear.robot} carries no token: it never moves"
            yield Defect("legal", "lost token", text, (number,), gear.places[:1])
        elif count > 1:
            where = listing(names[p].name for p in on)
            text = f"the gear of {gear.robot} carries {count} tokens, at {where}"
            yield Defect("legal", "doubled token", text, (number,), tuple(on))
    for place, owners in enumerate(subject.owners):
        if tokens[place] and not owners:
            text = f"place {names[place].name} is marked and in no gear"
            yield Defect("legal", "place in no gear", text, (), (place,))


def _unthreaded(net: GearNet | MarkedNet, subject: MarkedNet) -> Iterator[Defect]:
    """Marked places whose slots are not those of the robots that start there."""
    if isinstance(net, GearNet):
        initial = net.initial
    else:
        initial = tuple(next(p for p in g.places if net.tokens[p]) for g in net.gears)
    counts, starting = Counter(initial), dict[int, list[int]]()
    for robot, start in enumerate(initial):
        alone = counts[start] == 1 == subject.net.places[start].size
        if not alone or subject.slots[start] != (robot,):
            starting.setdefault(start, []).append(robot)
    for place, robots in sorted(starting.items()):
        slots, at = subject.slots[place], subject.net.places[place]
        if at.size != len(robots) or sorted(slots) != robots:
            text = (
                f"place {at.name} acts on {at.size} robots with slots for"
                f" {named(subject, slots)}, but the robots that start there are"
                f" {named(subject, robots)}"
            )
            yield Defect("legal", "slots", text, tuple(robots), (place,))
