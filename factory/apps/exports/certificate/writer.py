"""The certificate of a verdict: a JSON document that another program can check.

Keys: `schema` 2; `net` with `transitions` (name, `moves`: its redistribution function as quadruples
place, slot, place, slot, or null) and `places` (name, mode, label, `left`, `right`, `tokens`,
`size`, the number of robots it acts on, and `slots`: these robots, -1 for one without a gear; a
place without `size` has that of its slots); `robots` with name, type and gear (`places`,
`transitions`) and `initial` place. Everything is by number, from 0. Then one section for each
property with `holds`:

* `gear_net`: the `order` in which the gears are added, each with the `place` [a; b] it shares, the
  gears it `meets` there and `c`, or why condition (b) is `exempt`;
* `safe`: for each place a robot whose gear, a circuit with at most one token, has it (`cover`);
* `live`: an `order` of the places without token in which each comes after those it waits for;
* `reversible`: nothing: it follows from live and safe, as each place lies on a circuit;
* `legal`: the marked place of each robot, whose slots are those of the robots that start there;
* `gear_train`, of a net that is one and no gear net: an `order` of the transitions, by name, in
  which the gear of every robot, from its token on, ascends; null where the net is not live.

A property that fails (`holds` false), or is not proved in this way (null), has a `reason`, and the
names of the robots, places and transitions concerned. `digest` is the SHA-256 of the rest.
`check_certificate` (module `check`) gives the faults of such a document.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from factory.api import GearNet, GearProof, MarkedNet, Verdict
from factory.apps.exports.certificate.listing import CLAIMS, SCHEMA, TRAIN, digest

Json = dict[str, Any]


def certificate(net: GearNet | MarkedNet, verdict: Verdict) -> Json:
    """The certificate for the verdict that `verify` or `analyse` gave on the net. Linear.

    Raises ValueError where two places or transitions of the net have one name.
    """
    subject = MarkedNet.of(net)
    if verdict.gears and not subject.slots:
        subject = subject.with_gears(verdict.gears)
    if len(subject.net.place_index) < len(subject.tokens):
        raise ValueError("two places have one name")
    if len(subject.net.transition_index) < len(subject.net.transitions):
        raise ValueError("two transitions have one name")
    proof = GearProof.of(subject)
    document: Json = {
        "schema": SCHEMA,
        "net": _listing(net, subject),
        "robots": _robots(net, subject),
        **{claim: _section(claim, subject, proof, verdict) for claim in CLAIMS},
        **({TRAIN: _gear_train(subject, verdict)} if TRAIN in verdict.properties else {}),
    }
    return {**document, "digest": digest(document)}


def _listing(net: GearNet | MarkedNet, subject: MarkedNet) -> Json:
    moves: list[list[list[int]] | None] = [None] * len(subject.net.transitions)
    if isinstance(net, GearNet):
        functions = net.threaded.redistribution
        moves = [[[p, i, q, j] for (p, i), (q, j) in pairs] for pairs in functions]
    slots = subject.slots or ((),) * len(subject.tokens)
    return {
        "transitions": [
            {"name": t.name, "moves": move}
            for t, move in zip(subject.net.transitions, moves, strict=True)
        ],
        "places": [
            {
                "name": place.name,
                "mode": place.mode,
                "label": place.label,
                "left": list(place.left),
                "right": list(place.right),
                "tokens": tokens,
                "size": place.size,
                "slots": list(on),
            }
            for place, tokens, on in zip(subject.net.places, subject.tokens, slots, strict=True)
        ],
    }


def _robots(net: GearNet | MarkedNet, subject: MarkedNet) -> list[Json]:
    initial: Sequence[int | None] = _marked_places(subject)
    if isinstance(net, GearNet):
        initial = [*net.initial, *[None] * len(net.gears)][: len(net.gears)]
    return [
        {
            "name": gear.robot,
            "type": gear.type,
            "places": list(gear.places),
            "transitions": list(gear.transitions),
            "initial": place,
        }
        for gear, place in zip(subject.gears, initial, strict=True)
    ]


def _marked_places(net: MarkedNet) -> list[int | None]:
    """The first marked place of each gear."""
    return [next((p for p in gear.places if net.tokens[p]), None) for gear in net.gears]


def _section(claim: str, net: MarkedNet, proof: GearProof, verdict: Verdict) -> Json:
    holds = getattr(verdict, claim)
    if holds:
        by_gears = claim in ("gear_net", "legal") or verdict.method == "structure"
        follows = claim != "reversible" or (verdict.live and verdict.safe)
        evidence = _EVIDENCE[claim](net, proof) if by_gears and follows else None
        if evidence is None:
            return {"holds": None, "reason": "it holds, but not by gears alone: not certified"}
        return {"holds": True, **evidence}
    witness = next(w for w in verdict.witness if w.property == claim)
    names = {key: list(getattr(witness, key)) for key in ("robots", "places", "transitions")}
    return {"holds": holds, "kind": witness.kind, "reason": witness.reason, **names}


def _gear_net(net: MarkedNet, proof: GearProof) -> Json:
    order = []
    present: list[list[int]] = [[] for _ in net.tokens]
    for joint in proof.composition.joints:
        meets = [] if joint.place is None else list(present[joint.place])
        exempt = "tool of one operation" if meets and joint.c is None else None
        ends = {"place": joint.place, "a": joint.a, "b": joint.b, "c": joint.c}
        order.append({"gear": joint.gear, **ends, "meets": meets, "exempt": exempt})
        for place in net.gears[joint.gear].places:
            present[place].append(joint.gear)
    return {"order": order}


def _gear_train(net: MarkedNet, verdict: Verdict) -> Json:
    """Of a live train the order; of any other that it is one."""
    events = net.net.transitions
    proved = verdict.live and verdict.legal
    order = [events[e].name for e in net.token_free.order] if proved else None
    return {"holds": True, "order": order}


def _safe(net: MarkedNet, proof: GearProof) -> Json | None:
    covered = net.cover(proof.composition.closed)
    return None if MarkedNet.NONE in covered else {"cover": covered}


def _live(net: MarkedNet, proof: GearProof) -> Json:
    """The order of the transitions gives one of the places they mark."""
    events = net.token_free.order
    postset, tokens = net.net.postset, net.tokens
    order: list[int] = [p for event in events for p in postset[event] if not tokens[p]]
    begun = (p for p, producer in enumerate(net.left) if producer == MarkedNet.NONE)
    order += [p for p in begun if not tokens[p]]
    return {"order": order}


def _reversible(net: MarkedNet, proof: GearProof) -> Json | None:
    return None if _safe(net, proof) is None else {}


def _legal(net: MarkedNet, proof: GearProof) -> Json:
    return {"marked": _marked_places(net)}


_EVIDENCE: dict[str, Callable[[MarkedNet, GearProof], Json | None]] = {
    "gear_net": _gear_net,
    "safe": _safe,
    "live": _live,
    "reversible": _reversible,
    "legal": _legal,
}
