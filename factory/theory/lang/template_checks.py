"""From the clauses of a template to its value; templates that would break Theorem 5.1 are
refused."""

from __future__ import annotations

import re
from collections.abc import Mapping

from lark import Token

from factory.support.decimals import is_number, number
from factory.support.errors import did_you_mean
from factory.support.settings import DWELL
from factory.support.texts import Findings, counted, quoted
from factory.theory.lang.failures import FailureReader
from factory.theory.lang.template_syntax import (
    Labels,
    ParameterClause,
    RawLaw,
    TemplateDraft,
    Words,
)
from factory.theory.lang.values import ValueReader
from factory.theory.problem.pag import LABEL_HINT, NOPART, RESERVED, Value, is_label
from factory.theory.problem.parameters import WRITTEN
from factory.theory.problem.template import LOST, Failure, Law, Point, Template

_POINT = re.compile(r"([ABS])([0-9]+)(?:([+-])([0-9.]*(?:[eE][+-]?[0-9]+)?)r)?")
_VARIABLE = re.compile(r"LAB([1-9][0-9]{0,8})")
_LABELS_HINT = "<a; b> = < LAB1, LAB2, nopart; nopart, nopart, LAB3 >;"


class TemplateMaker:
    """Makes the template of a draft; errors go to the findings."""

    def __init__(self, draft: TemplateDraft, findings: Findings) -> None:
        self.draft, self.findings = draft, findings

    def make(self) -> Template | None:
        """The template, or None where its header or a clause is missing."""
        contents = {kind: clause.content for kind, clause in self.draft.clauses.items()}
        name, robots = self.draft.name, contents.get("R")
        labels: Labels | None = contents.get("<a; b>")
        count = self._robots(robots)
        carrier = self._carrier(contents.get("j"), count)
        classes = [
            [self._point(words, count) for words in points] for points in contents.get("~", ())
        ]
        clause: ParameterClause = contents.get("parameters", ParameterClause(False))
        parameters = self._parameters(clause)
        law = self._law(contents.get("F"), count, parameters)
        further: Token | None = contents.get("further")
        instead: Token | None = contents.get("instead")
        brought: Token | None = contents.get("brought")
        if name is not None:
            self._check_name(name)
        if labels is not None:
            self._check_labels(labels, count, carrier)
            self._check_kind(labels, clause.geometry)
            self._check_others(labels, carrier, contents)
        failures = self._failures(labels, carrier)
        if name is None or robots is None or carrier is None or labels is None or law is None:
            return None
        at = self.findings.source.at
        return Template(
            str(name),
            tuple(map(str, robots)),
            carrier,
            tuple(tuple(point for point in points if point) for points in classes),
            tuple(map(str, labels.before)),
            tuple(map(str, labels.after)),
            law,
            str(further or ""),
            str(instead or ""),
            tuple(parameters.items()),
            clause.geometry,
            failures,
            at(name),
            at(further) if further else None,
            at(instead) if instead else None,
            tuple(map(at, robots)),
            str(brought or ""),
            at(brought) if brought else None,
        )

    def _bad(self, message: str, at: Token, hint: str) -> None:
        self.findings.add("BadTemplate", message, at, hint)

    def _head(self, kind: str) -> Token:
        return self.draft.clauses[kind].head

    def _check_name(self, name: Token) -> None:
        if not is_label(name):
            self.findings.add("Syntax", f"{quoted(name)} is no name", name, LABEL_HINT)
        elif name in RESERVED - {"dropoff"}:
            message = f"{quoted(name)} is reserved and cannot name a template"
            self.findings.add("ReservedLabel", message, name, "choose another name")

    def _robots(self, robots: Words | None) -> int | None:
        """k, the number of robots, if it is known."""
        if robots is None:
            return None
        if not robots:
            hint = "name the type of each robot: R = < dot, dot, dot >;"
            self._bad("R is empty: an operation needs a robot", self._head("R"), hint)
            return None
        for robot in robots:
            if not is_label(robot):
                self._bad(f"{quoted(robot)} is no robot type", robot, LABEL_HINT)
        return len(robots)

    def _carrier(self, word: Token | None, count: int | None) -> int | None:
        """j, if 1 <= j <= k."""
        if word is None:
            return None
        j = int(word) if re.fullmatch("[0-9]{1,6}", word) else 0
        if j < 1 or (count is not None and j > count):
            most = count or "the number of robots in R"
            hint = f"j counts the robots from 1: write a whole number from 1 to {most}"
            self._bad(f"j = {word} names no robot of R", word, hint)
            return None
        return j

    def _point(self, words: Words, count: int | None) -> Point | None:
        """A point from its words; its robot is one of the k."""
        text, first = "".join(words), words[0]
        match = _POINT.fullmatch(text)
        multiple = _multiple(match) if match else None
        if match is None or multiple is None:
            hint = "a point is A1, B1 or S1 (start, end or a station of robot 1's path), or A1 + 2r"
            message = f"{quoted(' '.join(words))} is no point"
            self.findings.add("Syntax", message, first, hint)
            return None
        robot = int(match[2]) if len(match[2]) < 9 else 0
        if robot < 1 or (count is not None and robot > count):
            most = counted(count, "robot") if count else "robots from 1 on"
            hint = f"R has {most}; points are named {match[1]}1 to {match[1]}{count or 'k'}"
            self._bad(f"{quoted(' '.join(words))} names robot {match[2]}", first, hint)
            return None
        return Point(match[1], robot, multiple, self.findings.source.at(first))

    def _law(
        self, raw: RawLaw | None, count: int | None, parameters: Mapping[str, Value]
    ) -> Law | None:
        if raw is None:
            return None
        points = [self._point(words, count) for words in raw.goals]
        if count is not None and len(points) != count:
            hint = "F moves every robot of R: write one point for each, in order"
            at = raw.goals[0][0] if raw.goals else raw.name
            goals, robots = counted(len(points), "goal"), counted(count, "robot")
            self._bad(f"F has {goals} for {robots}", at, hint)
        eps = self._radius(raw.eps)
        dwell = self._dwell(raw.dwell, parameters) if raw.dwell else None
        reached = tuple(point for point in points if point)
        return Law(str(raw.name), reached, eps, dwell, self.findings.source.at(raw.name))

    def _radius(self, word: Token) -> float | str:
        """eps: a positive number, or the word."""
        value = number(word)
        if word == "eps":
            return "eps"
        if value is None or value <= 0:
            hint = "the goal ball needs a radius: write eps, or a positive number of metres"
            self._bad(f"{quoted(word)} is no radius", word, hint)
            return "eps"
        return value

    def _dwell(self, word: Token, parameters: Mapping[str, Value]) -> float | str | None:
        """A number of seconds, or the name of a parameter that is one."""
        if is_number(word):
            value = number(word)
            if value is None or not 0 <= value <= DWELL:
                hint = f"write seconds, from 0 to {DWELL:g}, or the name of a parameter"
                self._bad(f"{quoted(word)} is no time to dwell", word, hint)
            return value
        default = parameters.get(word)
        if "parameters" in self.draft.broken:
            return str(word)
        if not isinstance(default, float) or not 0 <= default <= DWELL:
            what = "is no parameter" if default is None else "is no time to dwell"
            hint = did_you_mean(word, list(parameters))
            if not hint.startswith("did"):
                hint = f"add the clause: parameters = ( {word} = 1.0 );"
            if default is not None:
                hint = f"its default is seconds, from 0 to {DWELL:g}: {word} = 1.0"
            self._bad(f"{quoted(word)} {what}", word, hint)
        return str(word)

    def _parameters(self, clause: ParameterClause) -> dict[str, Value]:
        made: dict[str, Value] = {}
        values = ValueReader(self.findings)
        for name, default in clause.values:
            if not is_label(name):
                self.findings.add("Syntax", f"{quoted(name)} is no name", name, LABEL_HINT)
            elif name in made:
                self._bad(f"{quoted(name)} is given twice", name, "remove one of the two")
            elif clause.geometry and name in WRITTEN:
                hint = "choose another name: geometry brings " + ", ".join(WRITTEN)
                self._bad(f"{quoted(name)} is a parameter of geometry", name, hint)
            elif (value := values.any(name, default)) is not None:
                made[str(name)] = value
        return made

    def _failures(self, labels: Labels | None, carrier: int | None) -> tuple[Failure, ...]:
        """The failures that are tested; LOST without a clause."""
        clause = self.draft.clauses.get("failure")
        if clause is None:
            return LOST
        takes = labels is None or any(label != NOPART for label in labels.before)
        tools = labels is None or any(
            label == NOPART and robot != carrier for robot, label in enumerate(labels.before, 1)
        )
        return FailureReader(self.findings, takes, tools).read(clause.content)

    def _check_kind(self, labels: Labels, geometry: bool) -> None:
        """Geometry belongs to operations that take nothing."""
        if geometry and any(label != NOPART for label in labels.before):
            hint = "leave out 'geometry', or let every robot come with nopart"
            message = "geometry belongs to parts, but the operation takes sub-assemblies"
            self._bad(message, self._head("parameters"), hint)

    def _check_others(
        self, labels: Labels, carrier: int | None, contents: Mapping[str, Token]
    ) -> None:
        """Each clause that names another template needs inputs that this can be for."""
        name, taking = self.draft.name, [n for n, x in enumerate(labels.before, 1) if x != NOPART]
        for kind, fits, message, those in (
            (
                "further",
                taking and name != "dropoff",
                f"{name} cannot pass further inputs on",
                "operations that take and make something",
            ),
            (
                "instead",
                len(taking) == 2 and carrier not in taking,
                f"{name} has no robot to spare",
                "carriers that take what two others bring",
            ),
            (
                "brought",
                {*taking} - {carrier},
                f"no robot brings anything to the carrier of {name}",
                "robots that have their inputs handed over",
            ),
        ):
            if kind in contents and not fits:
                self._bad(message, contents[kind], f"leave this clause out: it is for {those}")

    def _check_labels(self, labels: Labels, count: int | None, carrier: int | None) -> None:
        """The conditions on <a; b>, each with its code."""
        for side, words in zip("ab", labels, strict=True):
            if count is not None and len(words) != count:
                hint = f"write one label for each robot of R, as in {_LABELS_HINT}"
                labelled, robots = counted(len(words), "label"), counted(count, "robot")
                message = f"{side} has {labelled} for {robots}"
                self._bad(message, words[0] if words else self._head("<a; b>"), hint)
            for word in words:
                if word != NOPART and not _VARIABLE.fullmatch(word):
                    hint = "write LAB1, LAB2, ... for labels, or nopart"
                    self._bad(f"{quoted(word)} is no label variable", word, hint)
        self._check_inputs(labels.before)
        if self.draft.name == "dropoff":
            self._check_dropoff(labels)
        elif carrier is not None and carrier <= len(labels.after):
            self._check_gears(labels, carrier)

    def _check_inputs(self, before: Words) -> None:
        """The variables of a are LAB1 to LABm, each once."""
        seen: dict[int, Token] = {}
        odd = False
        for word in before:
            match = _VARIABLE.fullmatch(word)
            if match is None:
                odd = odd or word != NOPART
            elif int(match[1]) in seen:
                hint = "a sub-assembly is brought by one robot: give the other a label of its own"
                self.findings.add("DuplicateInput", f"{quoted(word)} is brought twice", word, hint)
            else:
                seen[int(match[1])] = word
        wanted = next(i for i in range(1, len(seen) + 2) if i not in seen)
        if not odd and any(number_of > wanted for number_of in seen):
            message = f"no robot brings LAB{wanted}: that sub-assembly would be lost"
            hint = f"number the labels in a from LAB1 to LAB{len(seen)}"
            self.findings.add("LostSubtree", message, seen[max(seen)], hint)

    def _check_dropoff(self, labels: Labels) -> None:
        if [list(map(str, words)) for words in labels] != [["LAB1"], [NOPART]]:
            hint = "the output robot drops the product: <a; b> = < LAB1; nopart >;"
            self._bad("dropoff takes one product and leaves nothing", self._head("<a; b>"), hint)

    def _check_gears(self, labels: Labels, carrier: int) -> None:
        """b_j is a fresh label, every other b_i is nopart: each robot's gear closes."""
        result = labels.after[carrier - 1]
        if result == NOPART:
            message = f"the carrier, robot {carrier}, is left with nothing"
            hint = "b_j is the label of what has been made; the others are nopart"
            self.findings.add("GearNotClosed", message, result, hint)
        elif str(result) in map(str, labels.before):
            message = f"the result {quoted(result)} is also an input"
            brought = {str(label) for label in labels.before} - {NOPART}
            hint = f"give the result a new label: LAB{len(brought) + 1}"
            self.findings.add("LabelReuse", message, result, hint)
        for index, word in enumerate(labels.after, 1):
            if index != carrier and word != NOPART:
                message = (
                    f"robot {index} is not the carrier (j = {carrier}) but keeps {quoted(word)}"
                )
                hint = "only the carrier holds something afterwards: write nopart"
                self.findings.add("GearNotClosed", message, word, hint)


def _multiple(match: re.Match[str]) -> float | None:
    """The offset of a point in radii; None if it is no finite number."""
    if match[3] is None:
        return 0.0
    size = number(match[4]) if match[4] else 1.0
    return -size if size is not None and match[3] == "-" else size
