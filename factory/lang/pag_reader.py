"""From text to PAG, the first stage.

It reports every error of a text at once, in the order of the text. A PAG that it returns is one
tree over its labels, each made by a known operation with the inputs and values that it takes.
"""

from __future__ import annotations

import os
from collections.abc import Mapping

from factory.lang.allowances import allowances_of
from factory.lang.copies import written_out
from factory.lang.operations import AssemblyReader, signature
from factory.lang.pag_syntax import read_statements
from factory.lang.source import STDIN, Findings, quoted, read_text, source_of
from factory.lang.statements import Statements
from factory.lang.tree import TreeCheck
from factory.lang.words import UNITS
from factory.problem.pag import PAG
from factory.problem.template import Template
from factory.support.collector import collector_paused
from factory.support.errors import Diagnostic, InputError, did_you_mean

KINDS = {
    ".pnml": (
        "a net in PNML",
        "it has no parts that could be moved: `factory check {}` proves it, `factory analyze {}` "
        "finds its pace, and `export` draws it; here give a PAG",
    ),
    ".ldr .mpd .dat": ("an LDraw model", "`factory import {}` makes a PAG of it, `plan` too"),
    ".step .stp .glb .3mf": ("a model of parts in place", "`factory plan {}` makes a PAG of it"),
    ".stl .obj .ply": ("a mesh", 'name it in a PAG: part = atomic ( mesh = "{}" );'),
    ".csv .json .yaml .yml": ("a table or a tree", "`factory import {}` makes a PAG of it"),
    ".xml .mjb": ("a model of the engine", "give the PAG that it was built from"),
    ".op": ("an operation", "give the PAG, and the folder of this file to --templates"),
    ".toml": ("a file of settings", "give the PAG beside it"),
}
"""Files that are no PAGs, by their endings: what each is, and what can be done with it."""

WORDS = {
    "mm": "mm millimeter millimetre millimeters millimetres",
    "cm": "cm centimeter centimetre centimeters centimetres",
    "m": "m meter metre meters metres si",
    "in": "in inch inches zoll",
}
"""Words that mean a unit."""


@collector_paused()
def read_pag(
    text: str, templates: Mapping[str, Template], file: str = "<text>", folder: str | None = "."
) -> PAG:
    """The PAG of a text. Mesh paths start at `folder`; they are not followed where that is None.
    Raises InputError."""
    findings = Findings(source_of(text, file))
    statements = read_statements(findings)
    signatures = {name: signature(template) for name, template in templates.items()}
    unit = unit_of(statements, findings)
    reader = AssemblyReader(findings, signatures, folder, unit)
    nodes = tuple(map(reader.read, written_out(statements, findings)))
    TreeCheck(statements, nodes, findings).run()
    allowed = allowances_of(statements, nodes, unit, findings)
    findings.raise_if_any()
    count = next((int(token.lstrip("0") or 0) for token in statements.counts), None)
    return PAG(str(statements.roots[0]), nodes, count, folder or ".", file, allowed)


def unit_of(statements: Statements, findings: Findings) -> str:
    """The unit of the lengths of a text: the one it says, else metres."""
    for unit in statements.units:
        if unit not in UNITS:
            near = next((u for u, words in WORDS.items() if unit.lower() in words.split()), "")
            hint = f"write: unit = {near};" if near else did_you_mean(unit, list(UNITS), "units")
            findings.add("BadValue", f"there is no unit of length {quoted(unit)}", unit, hint)
    for unit in statements.units[1:]:
        hint = "one unit holds for all lengths of the text: remove one of the two"
        findings.add("BadValue", "the unit is given twice", unit, hint)
    return next((str(unit) for unit in statements.units if unit in UNITS), "m")


def load_pag(path: str | os.PathLike[str], templates: Mapping[str, Template]) -> PAG:
    """The PAG in a file, or in what comes in for `-`. Raises InputError, also if the file cannot be
    read (BadFile), or is something else (Usage)."""
    name = os.fspath(path)
    _check_kind(name)
    shown = "<stdin>" if name == STDIN else name
    return read_pag(read_text(name), templates, shown, os.path.dirname(name) or ".")


def _check_kind(name: str) -> None:
    """Raises InputError (Usage) for a file that is something else by its ending."""
    ending = os.path.splitext(name)[1].lower()
    kind, hint = next((told for ends, told in KINDS.items() if ending in ends.split()), ("", ""))
    if kind and os.path.isfile(name):
        message = f"{quoted(name)} is {kind}, not the PAG of a product"
        raise InputError(Diagnostic("Usage", message, None, hint.format(*[name] * 2)))
