"""From a statement to a node of a PAG, checked against the template of its operation."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from itertools import dropwhile
from sys import intern
from types import MappingProxyType
from typing import TypeGuard

from lark import Token

from factory.support.decimals import UNITS, is_number
from factory.support.errors import Position, did_you_mean
from factory.support.texts import Findings, near_file, quoted, where
from factory.theory.lang.statements import Definition, Keyword
from factory.theory.lang.turns import quaternion_of
from factory.theory.lang.values import ValueReader
from factory.theory.problem.pag import (
    LABEL_HINT,
    MESHES,
    RESERVED,
    SHAPES,
    Assembly,
    Parameter,
    is_label,
)
from factory.theory.problem.parameters import GEOMETRY, WRITTEN
from factory.theory.problem.template import Signature


def _words(meant: Mapping[str, str]) -> Mapping[str, str]:
    """The name for each of its synonyms."""
    return MappingProxyType({word: name for name, line in meant.items() for word in line.split()})


MEANT = _words(
    {
        "pos": "position at place location xyz translate origin",
        "rgba": "color colour rgb col",
        "turn": "rotation rotate rot orientation angle angles euler rpy degrees",
        "quat": "quaternion",
        "box": "size dimensions dims cube cuboid block",
        "cylinder": "cyl radius height rod tube",
        "sphere": "ball",
        "mesh": "file path stl obj model shape geometry",
        "mass": "weight kg",
        "dwell": "time duration seconds wait",
    }
)
"""The parameters that are meant by words that people write in their place."""

MEANT_OPERATIONS = _words(
    {
        "atomic": "part box cylinder sphere mesh component primitive leaf",
        "mate": "join assemble attach combine connect merge union add fit",
        "insert": "put place",
        "weld": "solder fasten",
        "glue": "bond stick",
    }
)
"""The operations that are meant by words that people write in their place."""

PLANNED = (".step", ".stp", ".3mf", ".off", ".iges", ".igs")
"""Endings of CAD files that are no meshes of a PAG."""

ROTATIONS = ("turn", "quat")
"""Parameters that give a part a rotation."""


class AssemblyReader:
    """Makes assemblies from definitions, whose lengths are in a unit; errors go to the findings.
    `folder` is where mesh paths start; they are not followed where it is None."""

    def __init__(
        self,
        findings: Findings,
        signatures: Mapping[str, Signature],
        folder: str | None,
        unit: str = "m",
    ) -> None:
        self.findings, self.signatures, self.folder = findings, signatures, folder
        self.values, self.unit = ValueReader(findings, unit), unit
        self.meshes: dict[str, tuple[str, str] | None] = {}

    def read(self, definition: Definition) -> Assembly:
        """The assembly of a definition; incomplete where errors were noted."""
        label, operation, arguments, _ = definition
        assert isinstance(label, Token)
        at = self.findings.source.at
        entry = self.signatures.get(operation)
        if entry is not None and entry.parameters:
            arguments = self._without_loose_numbers(entry, arguments)
        inputs = [argument for argument in arguments if isinstance(argument, Token)]
        keywords: list[Keyword] = []
        if len(inputs) < len(arguments):
            keywords = [argument for argument in arguments if isinstance(argument, Keyword)]
            self._check_order(arguments)
        self._check_label(label)
        if entry is None or operation in RESERVED:
            self._unknown(operation, label, inputs)
        else:
            self._check_inputs(entry, operation, inputs)
        if entry is None or not entry.inputs:
            inputs = [token for token in inputs if not is_number(token)]
        return Assembly(
            intern(str(label)),
            intern(str(operation)),
            tuple([intern(str(token)) for token in inputs]),
            self._parameters(entry, keywords) if entry and keywords else (),
            at(label),
            tuple([at(token) for token in inputs]),
        )

    def _check_label(self, label: Token) -> None:
        if not is_label(label):
            self.findings.add("Syntax", f"{quoted(label)} is no label", label, LABEL_HINT)
        elif label in RESERVED:
            hint = f"choose another label; reserved are {', '.join(sorted(RESERVED))}"
            if label == "root":
                hint = "write: root = label; and define that label in a statement of its own"
            message = f"{quoted(label)} is reserved and cannot be a label"
            self.findings.add("ReservedLabel", message, label, hint)

    def _check_order(self, arguments: Sequence[Token | Keyword]) -> None:
        behind = dropwhile(lambda argument: isinstance(argument, Token), arguments)
        for argument in behind:
            if isinstance(argument, Token):
                message = f"the input {quoted(argument)} stands behind a parameter"
                hint = "write the inputs first, then the parameters"
                self.findings.add("Syntax", message, argument, hint)

    def _without_loose_numbers(
        self, entry: Signature, arguments: Sequence[Token | Keyword]
    ) -> list[Token | Keyword]:
        """Arguments without `box = 1, 2, 3`, which is noted as an error."""
        kept: list[Token | Keyword] = []
        left = list(reversed(arguments))
        while left:
            argument = left.pop()
            name, value = argument if isinstance(argument, Keyword) else (argument, argument)
            kind = entry.parameters.get(name) if isinstance(argument, Keyword) else None
            alone = not left or not _is_bare_number(left[-1])
            if (
                kind is None
                or not _is_bare_number(value)
                or kind.length < 1
                or (kind.length == 1 and alone)
            ):
                kept.append(argument)
                continue
            numbers = [value]
            while left and _is_bare_number(following := left[-1]):
                numbers.append(following)
                left.pop()
            message = f"the numbers of {quoted(name)} are not in parentheses"
            hint = f"write: {name} = ( {', '.join(numbers)} )"
            if kind.length == 1:
                message = f"{quoted(name)} takes one number, not {len(numbers)}"
                hint = f"decimals stand behind a point: {name} = {'.'.join(numbers[:2])}"
            elif len(numbers) != kind.length:
                hint = f"it takes {kind.wanted}, for example: {name} = {kind.example}"
            self.findings.add("BadValue", message, value, hint)
        return kept

    def _unknown(self, operation: Token, label: Token, inputs: Sequence[Token]) -> None:
        names = sorted({*self.signatures} - RESERVED)
        meant = MEANT_OPERATIONS.get(operation.lower(), "")
        near = meant in names
        hint = f"did you mean '{meant}'?" if near else did_you_mean(operation, names, "operations")
        message = f"there is no operation {quoted(operation)}"
        if operation in SHAPES:
            value = f"( {', '.join(inputs)} )" if inputs else GEOMETRY[operation].example
            hint = f"write: {label} = atomic ( {operation} = {value} )"
        if operation == "dropoff":
            message = "'dropoff' is not an operation of a PAG"
            hint = "the factory drops the product off by itself: name it with root = label;"
        self.findings.add("UnknownOperation", message, operation, hint)

    def _check_inputs(self, entry: Signature, operation: Token, inputs: list[Token]) -> None:
        count = len(inputs)
        if count == entry.inputs or (count > entry.inputs and entry.further):
            return
        odd = inputs[entry.inputs] if count > entry.inputs else None
        names = ", ".join(f"input{i}" for i in range(1, entry.inputs + 1))
        hint = f"write: {entry.name} ( {names}{', ...' * entry.further} )"
        if not entry.inputs:
            hint = f"write: {entry.name}(); it makes a part out of nothing else"
        elif entry.inputs == 1 and odd and not is_number(odd):
            joined = f"joined = mate ( {', '.join(inputs)} );"
            hint = f"join them first, in a statement of its own: {joined} {entry.name} ( joined )"
        if odd and is_number(odd) and entry.parameters:
            name = "box" if "box" in entry.parameters else next(iter(entry.parameters))
            value = odd if name != "box" else f"( {', '.join(filter(is_number, inputs))} )"
            hint = f"a parameter needs its name, for example: {name} = {value}"
        message = f"{quoted(entry.name)} takes {entry.takes}, not {count or 'none'}"
        self.findings.add("WrongInputs", message, odd or operation, hint)

    def _parameters(self, entry: Signature, keywords: list[Keyword]) -> tuple[Parameter, ...]:
        seen: dict[str, Token] = {}
        made: list[Parameter] = []
        for name, raw in keywords:
            kind = entry.parameters.get(name)
            if kind is None:
                self._unknown_parameter(entry, name)
            elif name in seen:
                at = self.findings.source.at
                message = f"{quoted(name)} is given twice, first {where(at(seen[name]), at(name))}"
                self.findings.add("BadValue", message, name, "remove one of the two")
            elif (value := self.values.read(name, kind, raw)) is not None:
                position = self.values.place(raw)
                if kind is WRITTEN["turn"] and isinstance(value, tuple):
                    made.append(Parameter("quat", quaternion_of(value), position))
                else:
                    made.append(Parameter(str(name), value, position))
                if kind is GEOMETRY["mesh"]:
                    self._check_mesh(str(value), position)
                    if self.unit != "m" and all(other.name != "scale" for other in keywords):
                        made.append(Parameter("scale", UNITS[self.unit], position))
            seen.setdefault(name, name)
        if len(seen) > 1 and entry.parameters.get("mesh") is GEOMETRY["mesh"]:
            self._check_one("shape", SHAPES, seen)
            self._check_one("rotation", ROTATIONS, seen)
        return tuple(made)

    def _unknown_parameter(self, entry: Signature, name: Token) -> None:
        message = f"{quoted(entry.name)} has no parameter {quoted(name)}"
        meant = MEANT.get(name.lower(), "")
        hint = did_you_mean(name, list(entry.parameters), "parameters")
        if meant in entry.parameters:
            hint = (
                f"did you mean '{meant}'? for example: {meant} = {entry.parameters[meant].example}"
            )
        if not entry.parameters:
            hint = "remove it: that operation has no parameters"
        self.findings.add("UnknownParameter", message, name, hint)

    def _check_one(self, what: str, names: Sequence[str], seen: Mapping[str, Token]) -> None:
        """Note each but the first of parameters of which a part has one."""
        tokens = [token for name, token in seen.items() if name in names]
        for other in tokens[1:]:
            message = (
                f"a part has one {what}, but {quoted(tokens[0])} and {quoted(other)} are given"
            )
            self.findings.add("BadValue", message, other, f"keep one of {', '.join(names)}")

    def _check_mesh(self, path: str, position: Position) -> None:
        if path not in self.meshes:
            self.meshes[path] = _mesh_problem(self.folder, path)
        problem = self.meshes[path]
        if problem:
            self.findings.add("BadMesh", problem[0], position, problem[1])


def _is_bare_number(argument: object) -> TypeGuard[Token]:
    return isinstance(argument, Token) and argument.type == "WORD" and is_number(argument)


def _mesh_problem(folder: str | None, path: str) -> tuple[str, str] | None:
    """The message and hint for a bad mesh path; without a folder only its suffix is checked."""
    if os.path.splitext(path)[1].lower() in PLANNED:
        hint = f"`factory plan {path}` makes a PAG of it, with its parts as meshes"
        return f"{quoted(path)} is a CAD file, not a mesh file", hint
    if os.path.splitext(path)[1].lower() not in MESHES:
        return f"{quoted(path)} is not a mesh file", f"mesh files end in {', '.join(MESHES)}"
    full = os.path.join(folder or "", path)
    if folder is None or os.path.isfile(full):
        return None
    if os.path.isdir(full):
        return f"{quoted(path)} is a folder", "name a mesh file in it"
    hint = near_file(folder, path) or "mesh paths start at the folder of the PAG file"
    return f"there is no mesh file {quoted(path)}", hint
