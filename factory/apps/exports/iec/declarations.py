"""Declarations of IEC 61131-3: data types, program organization units, a configuration."""

from __future__ import annotations

from dataclasses import dataclass

SECTIONS = {
    "VAR_INPUT": "inputVars",
    "VAR_OUTPUT": "outputVars",
    "VAR_IN_OUT": "inOutVars",
    "VAR": "localVars",
}
"""Sections of variables in Structured Text, and their elements in PLCopen XML."""

ELEMENTARY = ("BOOL", "INT", "UINT", "UDINT", "LREAL", "TIME")
"""Elementary types that are used."""


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable, or an element of a structure: its name, and that of its type."""

    name: str
    type: str
    comment: str = ""


@dataclass(frozen=True, slots=True)
class Structure:
    """A structured type."""

    name: str
    elements: tuple[Variable, ...]
    comment: str = ""


@dataclass(frozen=True, slots=True)
class ArrayType:
    """A type of arrays, counted from 1 to `size`, of elements of one type. An array is always of a
    named type: two that are written out alike in two places are different types."""

    name: str
    size: int
    of: str
    comment: str = ""


DataType = Structure | ArrayType


@dataclass(frozen=True, slots=True)
class OrganizationUnit:
    """A program organization unit: a FUNCTION, which `returns` a type, a FUNCTION_BLOCK or a
    PROGRAM. `sections`: its variables by section; `body`: its statements, line by line."""

    kind: str
    name: str
    sections: tuple[tuple[str, tuple[Variable, ...]], ...]
    body: tuple[str, ...]
    returns: str = ""


@dataclass(frozen=True, slots=True)
class Configuration:
    """A configuration with one resource and one task, which runs a program in every `scan` [ms]."""

    name: str
    resource: str
    task: str
    scan: int
    instance: str
    program: str


@dataclass(frozen=True, slots=True)
class Declarations:
    """All that is declared; `name` of all, and `remarks` on it."""

    name: str
    remarks: tuple[str, ...]
    types: tuple[DataType, ...]
    units: tuple[OrganizationUnit, ...]
    configuration: Configuration


def comment(text: str) -> str:
    """A text that is safe in a comment: ASCII that does not end it."""
    text = text.encode("ascii", "backslashreplace").decode()
    return text.replace("(*", "( *").replace("*)", "* )")
