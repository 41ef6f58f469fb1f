"""Overlaps that a text allows: `allow ( peg, frame, 0.0005 );` of two parts, `allow ( 0.0005 );` of
all."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product

from lark import Token

from factory.lang.source import Findings, quoted
from factory.lang.statements import CopiedLabel, Permission, Statements
from factory.lang.words import number
from factory.problem.pag import AllowedOverlap, Assembly
from factory.support.errors import did_you_mean

HOW = "write: allow ( peg, frame, 0.0005 ); or, for all pairs: allow ( 0.0005 );"


def allowances_of(
    statements: Statements, nodes: Sequence[Assembly], unit: str, findings: Findings
) -> tuple[AllowedOverlap, ...]:
    """The overlaps that a text allows, whose depths are in a unit; the name of copies is each of
    them. Errors (BadValue, UndefinedLabel) go to the findings."""
    copied = [one.label for one in statements.definitions if isinstance(one.label, CopiedLabel)]
    groups = {str(label.name): [str(copy) for copy in label.labels()] for label in copied}
    parts = {node.label: not node.inputs for node in nodes}
    found: list[AllowedOverlap] = []
    for permission in statements.permissions:
        found += _read(permission, groups, parts, unit, statements.broken, findings)
    return tuple(found)


def _read(
    permission: Permission,
    groups: Mapping[str, Sequence[str]],
    parts: Mapping[str, bool],
    unit: str,
    broken: set[str],
    findings: Findings,
) -> Iterator[AllowedOverlap]:
    *labels, last = permission.words
    at, depth = findings.source.at(permission.word), number(last, unit)
    pairs = [
        pair for pair in product(*(groups.get(x, [str(x)]) for x in labels)) if len({*pair}) > 1
    ]
    if len(labels) not in (0, 2) or depth is None or depth < 0 or (labels and not pairs):
        words = ", ".join(permission.words)
        message = f"an overlap is allowed of two parts, or of all, up to a depth, not ( {words} )"
        findings.add("BadValue", message, last if len(labels) == 2 else permission.word, HOW)
        return
    for label in labels:
        if label not in groups and not parts.get(label) and label not in broken:
            _refuse(label, label in parts, [part for part in parts if parts[part]], findings)
            return
    yield from (AllowedOverlap(depth, pair, at) for pair in pairs or [()])


def _refuse(label: Token, made: bool, parts: Sequence[str], findings: Findings) -> None:
    if made:
        hint = "name the parts of it that overlap"
        findings.add("BadValue", f"{quoted(label)} is no part, it is made of some", label, hint)
        return
    hint = did_you_mean(label, parts, "parts")
    findings.add("UndefinedLabel", f"there is no part {quoted(label)}", label, hint)
