"""Whether the assemblies of a text are one tree under the root: a PAG (paper, section 4.1).

Every check is linear in the number of labels, and none recurses.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from lark import Token

from factory.lang.pag_syntax import Statements
from factory.lang.source import Findings, Source, quoted
from factory.lang.words import LABEL_HINT, is_label, is_number
from factory.problem.pag import RESERVED, Assembly
from factory.support.errors import Position, did_you_mean

SUGGESTIONS = 20
CANDIDATES = 1000


@dataclass(slots=True)
class TreeCheck:
    """Checks nodes against each other; what is wrong goes to the findings.

    Labels that occur in statements that did not parse (`draft.broken`) get the benefit of the
    doubt: they may well be defined or used there.
    """

    draft: Statements
    nodes: Sequence[Assembly]
    source: Source
    findings: Findings
    defined: dict[str, Assembly] = field(default_factory=dict)
    users: dict[str, tuple[Assembly, int]] = field(default_factory=dict)
    undefined: dict[str, list[Position]] = field(default_factory=dict)
    excused: set[str] = field(default_factory=set)

    def run(self) -> None:
        """All checks."""
        self._define()
        self._use()
        self._check_roots()
        free = self._free()
        self._check_undefined(free)
        self._check_unreachable(free)
        self._check_cycles()
        self._check_counts()

    def _define(self) -> None:
        for node in self.nodes:
            first = self.defined.setdefault(node.label, node)
            if first is not node and first.position and node.position:
                where = _whereabouts(first.position, node.position)
                message = f"{quoted(node.label)} is defined twice, first {where}"
                hint = "every label is defined once: rename one of the two"
                self.findings.add("DuplicateLabel", message, node.position, hint)

    def _use(self) -> None:
        for node in self.nodes:
            for index, label in enumerate(node.inputs):
                if label == node.label:
                    if node.inputs.index(label) == index:
                        self._report_cycle([label])
                elif label not in self.defined:
                    self._use_undefined(label, node.input_positions[index])
                elif label in self.users:
                    self._report_second_use(label, node.input_positions[index])
                else:
                    self.users[label] = (node, index)

    def _use_undefined(self, label: str, position: Position) -> None:
        if label in RESERVED:
            message = f"{quoted(label)} is reserved: it is no sub-assembly"
            hint = "use the label of a sub-assembly"
            self.findings.add("ReservedLabel", message, position, hint)
        elif not is_label(label):
            self.findings.add("Syntax", f"{quoted(label)} is no label", position, LABEL_HINT)
        elif label not in self.draft.broken and not self.draft.nameless:
            self.undefined.setdefault(label, []).append(position)

    def _report_second_use(self, label: str, position: Position) -> None:
        user, index = self.users[label]
        first = user.input_positions[index]
        message = f"{quoted(label)} is used twice, first {_whereabouts(first, position)}"
        hint = f"a sub-assembly goes into one other: define a second one, say {label}-2"
        self.findings.add("PagNotTree", message, position, hint)

    def _check_roots(self) -> None:
        roots = self.draft.roots
        for root in roots[1:]:
            message = f"the root is given twice, first in line {roots[0].line}"
            if roots[0].line == root.line:
                message = f"the root is given twice, first at column {roots[0].column}"
            hint = "a factory makes one product: remove one of the two"
            self.findings.add("Root", message, self.source.at(root), hint)
        for root in roots[:1]:
            if root not in self.defined:
                self._use_undefined(str(root), self.source.at(root))
        if not roots and "root" not in self.draft.broken and "root" not in self.defined:
            self._report_missing_root()

    def _report_missing_root(self) -> None:
        if not self.nodes:
            if not self.draft.broken:
                message = "there is no product: nothing is defined"
                hint = "the shortest text: root = part; part = atomic();"
                self.findings.add("Root", message, self.source.start(), hint)
            return
        known = self.users.keys() | self.draft.broken
        tops = [label for label in self.defined if label not in known]
        at = self.defined[tops[0]].position if len(tops) == 1 else None
        hint = "name the finished product: root = label;"
        if tops:
            hint = f"name the finished product, which no other uses: root = {tops[0]};"
        if len(tops) > 1:
            shown = ", ".join(tops[:5]) + ", ..." * (len(tops) > 5)
            hint = f"name the finished product: root = label; no other uses {shown}"
        message = "missing root: the text does not say which label is the product"
        self.findings.add("Root", message, at or self.source.start(), hint)

    def _free(self) -> list[str]:
        """The labels that nothing uses, the root aside."""
        roots = {str(root) for root in self.draft.roots}
        return [label for label in self.defined if label not in self.users and label not in roots]

    def _check_undefined(self, free: Sequence[str]) -> None:
        """Labels that are used only; the likeliest meant are those that are defined only."""
        if not self.undefined:
            return
        known = sorted(self.draft.broken - self.users.keys())
        known = [*(label for label in free if label not in self.draft.broken), *known]
        taken = {diagnostic.position for diagnostic in self.findings.diagnostics}
        for number, (label, positions) in enumerate(self.undefined.items()):
            near: list[str] = []
            if number < SUGGESTIONS:
                near = [other for other in known if abs(len(other) - len(label)) <= 2]
            hint = did_you_mean(label, near[:CANDIDATES])
            if hint.startswith("did you mean"):
                self.excused.update(other for other in near if f"'{other}'" in hint)
            elif is_number(label):
                hint = f"define that label, or name the parameter it is a value of: name = {label}"
            else:
                hint = f"define it, for example: {label} = atomic();"
            for position in (place for place in positions if place not in taken):
                message = f"{quoted(label)} is not defined"
                self.findings.add("UndefinedLabel", message, position, hint)

    def _check_unreachable(self, free: Sequence[str]) -> None:
        doubtful = self.draft.broken | self.excused
        roots = self.draft.roots
        if not roots or roots[0] not in self.defined.keys() | self.draft.broken:
            return
        root = str(roots[0])
        for label in free:
            position = self.defined[label].position
            if label in doubtful or position is None or label in RESERVED:
                continue
            message = f"{quoted(label)} is not part of the product: nothing uses it"
            hint = f"use it in the making of {quoted(root)}, or remove it"
            if root in self.users:
                hint = f"{quoted(root)} goes into another: did you mean root = {label};"
            self.findings.add("UnreachableLabel", message, position, hint)

    def _check_cycles(self) -> None:
        """A label that, followed to its user and on, comes back to itself is made from itself."""
        done: set[str] = set()
        for start in self.defined:
            path: dict[str, None] = {}
            label = start
            while label not in done and label in self.users:
                done.add(label)
                path[label] = None
                label = self.users[label][0].label
            if label in path:
                self._report_cycle(list(_cut(path, label)))
            done.update(path)

    def _report_cycle(self, cycle: list[str]) -> None:
        first = min(range(len(cycle)), key=lambda i: self._rank(cycle[i]))
        turned = [*cycle[first:], *cycle[:first]]
        position = self.defined[turned[0]].position
        way = [turned[0], *reversed(turned)]
        if len(way) > 8:
            way[4:-3] = ["..."]
        shown = " from ".join(way)
        message = f"{quoted(turned[0])} is made from itself: {shown}"
        hint = "a product is a tree: use another sub-assembly in one of these statements"
        if position:
            self.findings.add("PagNotTree", message, position, hint)

    def _rank(self, label: str) -> tuple[int, int]:
        at = self.defined[label].position
        return (at.line, at.column) if at else (0, 0)

    def _check_counts(self) -> None:
        counts = self.draft.counts
        for count in counts[1:]:
            message = "the number of parts is given twice"
            hint = "remove one of the two"
            self.findings.add("Syntax", message, self.source.at(count), hint)
        if not counts or self.draft.broken or not RESERVED.isdisjoint(self.defined):
            return
        found = counts[0]
        right = len(self.defined)
        if str(right) == found.lstrip("0") or len(self.defined) < len(self.nodes):
            return
        if self.undefined and str(right + len(self.undefined)) == found:
            return
        message = f"the text says {quoted(found)} parts, but defines {right} labels"
        hint = f"write: {right} parts; (every label counts) or leave the number out"
        self.findings.add("WrongPartCount", message, self.source.at(found), hint)


def _whereabouts(first: Position, second: Position) -> str:
    return f"in line {first.line}" if first.line != second.line else f"at column {first.column}"


def _cut(path: dict[str, None], label: str) -> Iterator[str]:
    """The end of a path from `label` on."""
    found = False
    for step in path:
        found = found or step == label
        if found:
            yield step


def root_of(draft: Statements) -> str:
    """The product of a draft without errors."""
    return str(draft.roots[0])


def count_of(draft: Statements) -> int | None:
    """The number in `N parts` of a draft without errors."""
    token: Token | None = next(iter(draft.counts), None)
    return None if token is None else int(token.lstrip("0") or 0)
