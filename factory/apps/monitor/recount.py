"""The figures of the bodies of a run, recomputed from the states in its log.

The figures in a log are not trusted: contacts, gaps and turns at hand-overs, and errors of products
follow from positions, active constraints, and the model. A figure in the log may be neither larger
nor smaller than that, nor missing. The log has one state a tick, so shorter contacts are missed: a
log may have more of them, where what it names first was near each other then.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import degrees, radians
from typing import Any

import numpy as np

from factory.api import MonitorSubject, Observation, Replica, names
from factory.apps.log.reader import Log
from factory.apps.monitor.anatomy import GRIP, HOLD, PARK, Anatomy
from factory.engine.record.findings import Violation
from factory.support.arrays import Array, Index
from factory.support.engine import mujoco

PRESSED = 1e-4
"""Largest depth of a part in the pad that holds it, or is about to [m]."""

SAME = 5e-3
"""Tolerance of figures [mm, degrees]."""

NEAR = 5e-3
"""Things that touch within a tick are no further apart than this at its ends [m]."""

BOUNCES = 2.0
"""Largest number of contacts in a log by those that its states show, where they show any."""

WORDS = {
    "unintended_contacts": "unintended contacts",
    "handoff_gap_max_mm": "mm of gap at a hand-off",
    "handoff_angle_max_deg": "degrees of turn at a hand-off",
    "grip_gap_max_mm": "mm from a pad to the part it takes",
    "product_error_max_mm": "mm of error of a product",
    "product_angle_max_deg": "degrees of turn in a product",
}
"""The recomputed figures, in words."""

JUDGED = ("engine_warnings",)
"""The other figures that a log has of every run."""

MOST = "most"
"""The key of upper bounds on figures, where states give no more than that."""


def recounted(
    log: Log, subject: MonitorSubject, anatomy: Anatomy, m: Any, seen: Iterator[Observation]
) -> dict[str, Any]:
    """The figures in the observations `seen` of a log, by the keys of `kept_figures`."""
    contacts, places = _Contacts(subject, anatomy, m), _Places(subject, anatomy, m)
    before, row = next(seen), 0
    for now in seen:
        places.look(before, now)
        if not now.at_end:
            marked = {*log.marking[row].tolist(), *log.marking[row + 1].tolist()}
            row += 1
            contacts.look(before, now, marked)
        before = now
    most = {"product_error_max_mm": places.most_error}
    return {**places.figures, **contacts.figures(), MOST: most}


def differences(log: Log, counted: Mapping[str, Any], m: Any) -> list[Violation]:
    """The figures of a log that its states contradict, and those that it lacks."""
    kept, wrong = log.figures, list[str]()
    if kept is None:
        # a log of an older form has neither figures nor ends of operations
        ended = log.complete and log.ends is not None
        return [_contradicted(log, "the log has no figures")] if ended else []
    for key, words in WORDS.items():
        recorded, value = kept.get(key) or 0.0, counted[key] or 0.0
        most = counted[MOST].get(key, value)
        if key == "unintended_contacts" and recorded > value:
            most = BOUNCES * value if value or not _near(log, m) else recorded
        if key not in kept:
            wrong.append(f"the log does not say how many {words} there are")
        elif not value - SAME <= recorded <= most + SAME:
            wrong.append(f"the log has {recorded:g} {words}, its states {value:g}")
    for key in JUDGED:
        if key not in kept:
            wrong.append(f"the log has no figure '{key}'")
    return [_contradicted(log, words) for words in wrong]


def _contradicted(log: Log, words: str) -> Violation:
    return Violation(float(log.time[-1]), "", "", "Record", words)


def _near(log: Log, m: Any) -> bool:
    """Whether the geoms of the first contact of a log are near each other in its states then."""
    figures = log.figures or {}
    first, pairs = figures.get("contact_first_s"), figures.get("contacts", [])
    geoms = [m.geom(name).id for name in pairs[0].split(" - ")] if pairs else []
    if first is None or len(geoms) != 2:
        return False
    replica, row = Replica(m), log.row_at(first)
    for at in range(max(0, row - 1), min(row + 1, len(log))):
        replica.place(log.qpos[at])
        if mujoco.mj_geomDistance(replica.m, replica.d, *geoms, 2 * NEAR, None) <= NEAR:
            return True
    return False


def worst(kept: Mapping[str, Any] | None, counted: Mapping[str, Any]) -> dict[str, Any]:
    """The larger of both figures for each key, with the data of the contacts that are more."""
    kept = kept or {}
    figures = {**kept}
    for key in WORDS:
        values = [value for value in (kept.get(key), counted[key]) if value is not None]
        figures[key] = max(values, default=None)
    if counted["unintended_contacts"] > (kept.get("unintended_contacts") or 0):
        figures |= {key: counted[key] for key in ("contacts", "contact_first_s")}
    return figures


class _Contacts:
    """Unintended contacts, of bodies in the hands given by the active welds."""

    def __init__(self, subject: MonitorSubject, anatomy: Anatomy, m: Any) -> None:
        self._replica, self._anatomy = Replica(m), anatomy
        self._operations = {int(o.place): o for o in subject.factory.operations}
        self._apart = {frozenset(names.excluded(m.exclude(e).name)) for e in range(m.nexclude)}
        bodies = np.stack([m.exclude_signature >> 16, m.exclude_signature & 0xFFFF], axis=1)
        of_one = m.body_rootid[bodies[:, 0]] == m.body_rootid[bodies[:, 1]]
        self._links = {*map(frozenset, bodies[of_one].tolist())}
        self._replica.exclude_nothing()
        self._trunk = self._replica.trunk
        self._code = _codes(m, subject)
        self._holds = _held(m, subject, anatomy)
        self._in = np.full(m.nbody, Replica.NOBODY)
        self._welds: Index | None = None
        self._touching: set[tuple[int, int]] = set()
        self._onsets: list[tuple[float, int, int]] = []

    def look(self, before: Observation, now: Observation, marked: set[int]) -> None:
        """Record the contacts at the start of a tick, with the hands during the tick."""
        if now.welds is not self._welds:
            self._hold(now.welds)
        m, d = self._replica.m, self._replica.d
        self._replica.place(before.qpos)
        mujoco.mj_collision(m, d)
        contacts = d.contact
        touching = set()
        for number in np.flatnonzero(contacts.dist[: d.ncon] < 0).tolist():
            a, b = contacts.geom[number].tolist()
            if not self._intended(a, b, float(contacts.dist[number]), marked):
                touching.add((a, b))
        fresh = sorted(touching - self._touching)
        self._onsets += [(before.time, a, b) for a, b in fresh]
        self._touching = touching

    def figures(self) -> dict[str, Any]:
        """Number of onsets, pairs of geoms, and time of the first [s]."""
        name = self._replica.m.geom
        pairs = dict.fromkeys(f"{name(a).name} - {name(b).name}" for _, a, b in self._onsets)
        return {
            "unintended_contacts": len(self._onsets),
            "contacts": list(pairs),
            "contact_first_s": self._onsets[0][0] if self._onsets else None,
        }

    def _hold(self, welds: Index) -> None:
        """Assign parts to the holders in these welds (k, 3), the latest where there are several."""
        before = {*map(tuple, () if self._welds is None else self._welds.tolist())}
        fresh = [row for row in welds.tolist() if tuple(row) not in before]
        for body in {body for _, _, body in before} - {*welds[:, 2].tolist()}:
            if self._anatomy.copy_of[body] >= 0:
                self._replica.release(body)
        self._welds = welds
        for weld, holder, body in fresh:
            if self._anatomy.copy_of[body] < 0 or self._anatomy.holder[weld] is None:
                continue
            parked = self._anatomy.holder[weld] == (PARK, -1)
            code = Replica.NOBODY if parked else int(self._code[holder])
            self._in[self._trunk == body] = code
            self._replica.hold(body, code)

    def _intended(self, a: int, b: int, apart: float, marked: set[int]) -> bool:
        """Whether two geoms may touch: those of parts that are being joined or overlap in the
        product, those of a pad and the part it holds, and those of links of one arm that its model
        leaves out of contact."""
        m = self._replica.m
        bodies = m.geom_bodyid[[a, b]].tolist()
        if frozenset(bodies) in self._links:
            return True
        label = [names.part_of(m.body(body).name) for body in bodies]
        if all(label):
            robots = {int(self._in[body]) - 1 for body in bodies}
            at = (o for place in marked if (o := self._operations.get(place)))
            return frozenset(label) in self._apart or any(robots <= {*o.robots} for o in at)
        pad, part = (a, label[1]) if label[1] else (b, label[0])
        held = self._holds.get(names.pad_of(m.geom(pad).name), set())
        return apart >= -PRESSED and part in held


class _Places:
    """Errors of position of parts that change hands, and of the parts of products."""

    def __init__(self, subject: MonitorSubject, anatomy: Anatomy, m: Any) -> None:
        self._replica, self._anatomy = Replica(m), anatomy
        self._pads = self._replica.pads
        self._kind = np.array([holder[0] if holder else -1 for holder in anatomy.holder])
        self._place = {label: np.array(place) for label, place in subject.places.items()}
        order = [part for x in subject.factory.products for part in subject.factory.contents[x]]
        self._order = {part: number for number, part in enumerate(order)}
        self.figures: dict[str, float | None] = dict.fromkeys(WORDS)
        self.most_error = 0.0
        self._reach = _reaches(self._replica)

    def look(self, before: Observation, now: Observation) -> None:
        """Measure the parts that changed hands between two observations."""
        if now.welds is before.welds:
            return
        was, on = ({int(w): int(b) for w, _, b in seen.welds} for seen in (before, now))
        fresh = np.array([w for w, body in on.items() if was.get(w) != body], np.intp)
        parked = {body for weld, body in was.items() if self._kind[weld] == PARK}
        taken = [w for w in fresh.tolist() if self._kind[w] >= GRIP and on[w] not in parked]
        if now.at_end and taken:
            self._taken(np.array(taken), np.array([on[w] for w in taken]), now)
        for seen, held, other in ((now, on, was), (before, was, on)):
            held_now = {
                w: b for w, b in held.items() if self._kind[w] == HOLD and other.get(w) != b
            }
            if held_now:
                self._finished([*held_now.values()], seen.qpos)

    def _taken(self, welds: Index, bodies: Index, now: Observation) -> None:
        """Measure the welds that close on bodies, and the pads on the first body they take."""
        frames, qpos = self._anatomy.frames.chosen(welds), now.qpos
        pose = qpos[self._at(bodies)]
        slides = qpos[frames.along]
        gap = np.linalg.norm(pose[:, :3] - frames.at(slides), axis=1)
        self._note("handoff_gap_max_mm", 1e3 * float(gap.max()))
        self._note("handoff_angle_max_deg", _angle(pose[:, 3:], frames.turned(slides)))
        self._replica.switch(now.welds.astype(np.int32))
        self._replica.place(qpos)
        apart = self._pads.first_taken(self._replica.d, welds, now.welds[:, 0])
        if apart is not None:
            self._note("grip_gap_max_mm", 1e3 * apart)

    def _finished(self, bodies: Sequence[int], qpos: Array) -> None:
        """Measure the bodies of a product relative to the first of them."""
        name = {body: self._anatomy.label[self._anatomy.copy_of[body]] for body in bodies}
        order = sorted(bodies, key=lambda body: self._order.get(name[body], 0))
        pose, labels = qpos[self._at(np.array(order))], [name[body] for body in order]
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, pose[0, 3:])
        nominal = np.array([self._place[label] - self._place[labels[0]] for label in labels])
        fitted = (pose[:, :3] - pose[0, :3]) @ turn.reshape(3, 3)
        off = np.linalg.norm(fitted - nominal, axis=1)
        self._note("product_error_max_mm", 1e3 * float(off.max()))
        first = np.broadcast_to(pose[0, 3:], (len(pose), 4))
        self._note("product_angle_max_deg", _angle(pose[:, 3:], first))
        turned = [radians(_angle(one[None], pose[:1, 3:])) for one in pose[:, 3:]]
        most = off + np.array(turned) * self._reach[order]
        self.most_error = max(self.most_error, 1e3 * float(most.max()))

    def _at(self, bodies: Index) -> Index:
        """Addresses (n, 7) of bodies."""
        copies = self._anatomy.copy_of[bodies]
        return np.asarray(self._anatomy.body[copies][:, None] + np.arange(7))

    def _note(self, key: str, value: float) -> None:
        self.figures[key] = max(self.figures[key] or 0.0, value)


def _angle(one: Array, other: Array) -> float:
    """The largest angle between quaternions (n, 4) [degrees]."""
    sine = np.sqrt(np.maximum(0.0, 1.0 - (one * other).sum(axis=1) ** 2))
    return degrees(2 * float(np.arcsin(np.minimum(sine.max(), 1.0))))


def _reaches(replica: Replica) -> Array:
    """Distance of the geoms of each body from its origin, or more (nbody,) [m]."""
    m = replica.m
    reach = np.zeros(m.nbody)
    far = np.linalg.norm(m.geom_pos, axis=1) + m.geom_rbound
    np.maximum.at(reach, replica.trunk[m.geom_bodyid], far)
    return reach


def _codes(m: Any, subject: MonitorSubject) -> Index:
    """The code of each body that holds parts (nbody,): of a robot from its number, of any other
    from the masks of its geoms."""
    robots = {robot.name: Replica.robot_code(robot.index) for robot in subject.factory.robots}
    codes = np.zeros(m.nbody, np.intp)
    np.maximum.at(codes, m.geom_bodyid, m.geom_contype >> 1)
    for body in range(m.nbody):
        name = m.body(body).name
        codes[body] = robots.get(names.holder(name), codes[body])
    return codes


def _held(m: Any, subject: MonitorSubject, anatomy: Anatomy) -> dict[str, set[str]]:
    """The labels of all bodies that each holder ever holds, by the holder's name."""
    labels: dict[str, set[str]] = {}
    contents = subject.factory.contents
    for weld, holder in enumerate(anatomy.holder):
        if holder is not None and holder[0] != PARK:
            name = names.holder(m.body(int(m.eq_obj1id[weld])).name)
            label = anatomy.part[weld]
            owner = name.removesuffix("/slider")
            labels.setdefault(owner, set()).update((label, *contents.get(label, ())))
    return labels
