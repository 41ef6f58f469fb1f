"""Whether the assemblies of a text are a PAG: one tree under the root (paper, section 4.1).

Every check is linear in the number of labels, and none recurses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from factory.support.decimals import is_number
from factory.support.errors import Position, did_you_mean
from factory.support.texts import Findings, quoted, where
from factory.theory.lang.mixes import check_mix
from factory.theory.lang.statements import Statements
from factory.theory.problem.pag import LABEL_HINT, RESERVED, Assembly, is_label

SUGGESTIONS = 20
"""Undefined labels that get a suggestion."""

CANDIDATES = 1000
"""Defined labels that a suggestion is chosen from."""


@dataclass(slots=True)
class TreeCheck:
    """Checks nodes against each other; errors go to the findings.

    Labels in statements that did not parse (`statements.broken`) may be defined or used there, so
    they are not reported. `users`: the node that uses each label, and as which input; `excused`:
    labels suggested for undefined ones.
    """

    statements: Statements
    nodes: Sequence[Assembly]
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
        roots = {str(root) for root in self.statements.roots}
        free = [label for label in self.defined if label not in self.users and label not in roots]
        self._check_undefined(free)
        self._check_unreachable(free)
        self._check_cycles()
        self._check_counts()

    def _define(self) -> None:
        for node in self.nodes:
            first = self.defined.setdefault(node.label, node)
            if first is not node:
                before, at = _place(first), _place(node)
                message = f"{quoted(node.label)} is defined twice, first {where(before, at)}"
                hint = "every label is defined once: rename one of the two"
                self.findings.add("DuplicateLabel", message, at, hint)

    def _use(self) -> None:
        for node in self.nodes:
            if node.label in node.inputs:
                self._report_cycle([node.label])
            for index, label in enumerate(node.inputs):
                if label == node.label:
                    continue
                if label not in self.defined:
                    self._use_undefined(label, node.input_positions[index])
                elif label in self.users and not self.statements.mixed:
                    self._report_second_use(label, node.input_positions[index])
                else:
                    self.users.setdefault(label, (node, index))

    def _use_undefined(self, label: str, position: Position) -> None:
        if label in RESERVED:
            message = f"{quoted(label)} is reserved: it is no sub-assembly"
            self.findings.add("ReservedLabel", message, position, "use the label of a sub-assembly")
        elif not is_label(label):
            self.findings.add("Syntax", f"{quoted(label)} is no label", position, LABEL_HINT)
        elif label not in self.statements.broken and not self.statements.nameless:
            self.undefined.setdefault(label, []).append(position)

    def _report_second_use(self, label: str, position: Position) -> None:
        user, index = self.users[label]
        first = user.input_positions[index]
        message = f"{quoted(label)} is used twice, first {where(first, position)}"
        hint = f"a sub-assembly goes into one other: define a second one, say {label}-2"
        self.findings.add("PagNotTree", message, position, hint)

    def _check_roots(self) -> None:
        roots, at = self.statements.roots, self.findings.source.at
        if self.statements.mixed:
            check_mix(roots, self.defined, self.findings)
            for root in roots:
                if root not in self.defined:
                    self._use_undefined(str(root), at(root))
            return
        for root in roots[1:]:
            message = f"the root is given twice, first {where(at(roots[0]), at(root))}"
            hint = "a factory makes one product: remove one of the two"
            self.findings.add("Root", message, root, hint)
        if roots and roots[0] not in self.defined:
            self._use_undefined(str(roots[0]), at(roots[0]))
        if (
            not roots
            and self.statements.broken.isdisjoint(("root", "mix"))
            and "root" not in self.defined
        ):
            self._report_missing_root()

    def _report_missing_root(self) -> None:
        start = self.findings.source.start()
        if not self.nodes:
            if not self.statements.broken:
                message = "there is no product: nothing is defined"
                hint = "the shortest text: root = part; part = atomic();"
                self.findings.add("Root", message, start, hint)
            return
        used = self.users.keys() | self.statements.broken
        tops = [label for label in self.defined if label not in used]
        hint = "name the finished product: root = label;"
        if len(tops) == 1:
            hint = f"name the finished product, which no other uses: root = {tops[0]};"
            start = _place(self.defined[tops[0]])
        elif tops:
            shown = ", ".join(tops[:5]) + ", ..." * (len(tops) > 5)
            hint = f"name the finished product: root = label; no other uses {shown}"
        message = "missing root: the text does not say which label is the product"
        self.findings.add("Root", message, start, hint)

    def _check_undefined(self, free: Sequence[str]) -> None:
        """Labels that are used but not defined; suggestions are those defined but not used."""
        broken = self.statements.broken
        candidates = [label for label in free if label not in broken]
        candidates += sorted(broken - self.users.keys())
        taken = {diagnostic.position for diagnostic in self.findings.diagnostics}
        for number, (label, positions) in enumerate(self.undefined.items()):
            near: list[str] = []
            if number < SUGGESTIONS:
                near = [other for other in candidates if abs(len(other) - len(label)) <= 2]
            hint = did_you_mean(label, near[:CANDIDATES])
            if hint.startswith("did you mean"):
                self.excused.update(other for other in near if f"'{other}'" in hint)
            elif is_number(label):
                hint = f"define that label, or name the parameter it is a value of: name = {label}"
            else:
                hint = f"define it, for example: {label} = atomic();"
            for position in positions:
                if position not in taken:
                    message = f"{quoted(label)} is not defined"
                    self.findings.add("UndefinedLabel", message, position, hint)

    def _check_unreachable(self, free: Sequence[str]) -> None:
        doubtful = self.statements.broken | self.excused | RESERVED
        roots = self.statements.roots
        if not roots or roots[0] not in self.defined.keys() | self.statements.broken:
            return
        root, product = str(roots[0]), "a" if self.statements.mixed else "the"
        hint = f"use it in the making of {quoted(root)}, or remove it"
        for label in free:
            if label not in doubtful:
                message = f"{quoted(label)} is not part of {product} product: nothing uses it"
                if root in self.users and not self.statements.mixed:
                    hint = f"{quoted(root)} goes into another: did you mean root = {label};"
                self.findings.add("UnreachableLabel", message, _place(self.defined[label]), hint)

    def _check_cycles(self) -> None:
        """A label is made from itself if the chain from user to user leads back to it."""
        done: set[str] = set()
        for start in self.defined:
            path: dict[str, None] = {}
            label = start
            while label not in done and label in self.users:
                done.add(label)
                path[label] = None
                label = self.users[label][0].label
            if label in path:
                steps = list(path)
                self._report_cycle(steps[steps.index(label) :])
            done.update(path)

    def _report_cycle(self, cycle: list[str]) -> None:
        places = [_place(self.defined[label]) for label in cycle]
        first = min(range(len(cycle)), key=lambda i: (places[i].line, places[i].column))
        start = cycle[first]
        way = [start, *reversed([*cycle[first:], *cycle[:first]])]
        if len(way) > 8:
            way[4:-3] = ["..."]
        message = f"{quoted(start)} is made from itself: {' from '.join(way)}"
        hint = "a product is a tree: use another sub-assembly in one of these statements"
        self.findings.add("PagNotTree", message, places[first], hint)

    def _check_counts(self) -> None:
        counts = self.statements.counts
        for count in counts[1:]:
            message = "the number of parts is given twice"
            self.findings.add("Syntax", message, count, "remove one of the two")
        if not counts or self.statements.broken or not RESERVED.isdisjoint(self.defined):
            return
        count, right = counts[0], len(self.defined)
        if str(right) == count.lstrip("0") or right < len(self.nodes):
            return
        if self.undefined and str(right + len(self.undefined)) == count:
            return
        message = f"the text says {quoted(count)} parts, but defines {right} labels"
        hint = f"write: {right} parts; (every label counts) or leave the number out"
        self.findings.add("WrongPartCount", message, count, hint)


def _place(node: Assembly) -> Position:
    """The position of a node's definition."""
    assert node.position is not None
    return node.position
