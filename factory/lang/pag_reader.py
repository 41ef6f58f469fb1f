"""From text to PAG, the first stage.

It reports every error of a text at once, in the order of the text. A PAG that it returns is one
tree over its labels, each made by a known operation with the inputs and values that it takes.
"""

from __future__ import annotations

import os
from collections.abc import Mapping

from factory.lang.copies import written_out
from factory.lang.operations import AssemblyReader, signature
from factory.lang.pag_syntax import Statements, read_statements
from factory.lang.source import Findings, quoted, read_text, source_of
from factory.lang.tree import TreeCheck
from factory.lang.words import UNITS
from factory.problem.pag import PAG
from factory.problem.template import Template
from factory.support.collector import collector_paused
from factory.support.errors import did_you_mean


@collector_paused()
def read_pag(
    text: str, templates: Mapping[str, Template], file: str = "<text>", folder: str | None = "."
) -> PAG:
    """The PAG of a text. Mesh paths start at `folder`; they are not followed where that is None.
    Raises InputError."""
    findings = Findings(source_of(text, file))
    statements = read_statements(findings)
    signatures = {name: signature(template) for name, template in templates.items()}
    reader = AssemblyReader(findings, signatures, folder, unit_of(statements, findings))
    nodes = tuple(map(reader.read, written_out(statements, findings)))
    TreeCheck(statements, nodes, findings).run()
    findings.raise_if_any()
    count = next((int(token.lstrip("0") or 0) for token in statements.counts), None)
    return PAG(str(statements.roots[0]), nodes, count, folder or ".", file)


def unit_of(statements: Statements, findings: Findings) -> str:
    """The unit of the lengths of a text: the one it says, else metres."""
    for unit in statements.units:
        if unit not in UNITS:
            hint = did_you_mean(unit, list(UNITS), "units")
            findings.add("BadValue", f"there is no unit of length {quoted(unit)}", unit, hint)
    for unit in statements.units[1:]:
        hint = "one unit holds for all lengths of the text: remove one of the two"
        findings.add("BadValue", "the unit is given twice", unit, hint)
    return next((str(unit) for unit in statements.units if unit in UNITS), "m")


def load_pag(path: str | os.PathLike[str], templates: Mapping[str, Template]) -> PAG:
    """The PAG in a file. Raises InputError, also if the file cannot be read (BadFile)."""
    name = os.fspath(path)
    return read_pag(read_text(name), templates, name, os.path.dirname(name) or ".")
