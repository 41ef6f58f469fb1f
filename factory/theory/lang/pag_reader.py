"""From text to PAG, the first stage.

It reports every error of a text at once, in the order of the text. A PAG that it returns is one
tree over its labels, each made by a known operation with the inputs and values that it takes.

Copies are written out here: `screw[4] = atomic ( ... ) at ( 0, 0, 0 ), ...` is four definitions and
its name among the inputs of an operation is all four. Overlaps that the text allows are read too:
`allow ( peg, frame, 0.0005 );` of two parts, `allow ( 0.0005 );` of all.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import chain, product, repeat

from lark import Token

from factory.support.collector import collector_paused
from factory.support.decimals import UNITS, number
from factory.support.errors import did_you_mean, usage_error
from factory.support.guard import reading
from factory.support.texts import Findings, quoted, source_of
from factory.theory.lang.mixes import mix_of
from factory.theory.lang.operations import AssemblyReader
from factory.theory.lang.pag_syntax import read_statements
from factory.theory.lang.source import STDIN, read_text
from factory.theory.lang.statements import (
    COPIES,
    CopiedLabel,
    Definition,
    Keyword,
    Permission,
    Statements,
    labels_of,
)
from factory.theory.lang.tree import TreeCheck
from factory.theory.problem.pag import PAG, AllowedOverlap, Assembly
from factory.theory.problem.template import Template

KINDS = {
    ".pnml": (
        "a net in PNML",
        "it has no parts that could be moved: `factory check {}` proves it, and `export` draws "
        "it; here give a PAG",
    ),
    ".ldr .mpd .dat": ("an LDraw model", "`factory import {}` makes a PAG of it, `plan` too"),
    ".step .stp .glb .3mf": ("a model of parts in place", "`factory plan {}` makes a PAG of it"),
    ".stl .obj .ply": ("a mesh", 'name it in a PAG: part = atomic ( mesh = "{}" );'),
    ".csv .json .yaml .yml": ("a table or a tree", "`factory import {}` makes a PAG of it"),
    ".xml .mjb": ("a model of the engine", "give the PAG that it was built from"),
    ".op": ("an operation", "give the PAG, and the folder of this file to --templates"),
    ".toml": ("a file of settings", "give the PAG beside it"),
}
"""Files of other kinds, by their endings: the kind, and how it can be used."""

WORDS = {
    "mm": "mm millimeter millimetre millimeters millimetres",
    "cm": "cm centimeter centimetre centimeters centimetres",
    "m": "m meter metre meters metres si",
    "in": "in inch inches zoll",
}
"""Words that mean a unit."""

COPIES_FORM = "screw[2] = atomic ( ... ) at ( 0, 0, 0 ), ( 0, 0, 0.1 )"

ALLOW_FORM = "write: allow ( peg, frame, 0.0005 ); or, for all pairs: allow ( 0.0005 );"


@collector_paused()
def read_pag(
    text: str, templates: Mapping[str, Template], file: str = "<text>", folder: str | None = "."
) -> PAG:
    """The PAG of a text.

    Args:
        text: the text.
        templates: the operations that it may name, by name.
        file: the name of its file.
        folder: where mesh paths start; they are not followed where it is None.

    Raises InputError, also where its file or a mesh will be written over.
    """
    findings = Findings(source_of(text, file))
    statements = read_statements(findings)
    signatures = {name: template.signature for name, template in templates.items()}
    unit = unit_of(statements, findings)
    reader = AssemblyReader(findings, signatures, folder, unit)
    nodes = tuple(map(reader.read, written_out(statements, findings)))
    mix = mix_of(statements, findings)
    TreeCheck(statements, nodes, findings).run()
    allowed = allowances_of(statements, nodes, unit, findings)
    findings.raise_if_any()
    count = next((int(token.lstrip("0") or 0) for token in statements.counts), None)
    pag = PAG(str(statements.roots[0]), nodes, count, folder or ".", file, allowed, mix)
    if folder is not None:
        reading(*pag.files)
    return pag


def unit_of(statements: Statements, findings: Findings) -> str:
    """The unit of the lengths of a text, metres by default."""
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
    """The PAG in a file.

    Args:
        path: the file; `-` for stdin.
        templates: the operations that it may use, by name.

    Raises InputError with all errors of the text; BadFile where it cannot be read, Usage for a file
    of another kind.
    """
    name = os.fspath(path)
    _check_kind(name)
    shown = "<stdin>" if name == STDIN else name
    return read_pag(read_text(name), templates, shown, os.path.dirname(name) or ".")


def _check_kind(name: str) -> None:
    """Raises InputError (Usage) for a file whose ending says that it is of another kind."""
    ending = os.path.splitext(name)[1].lower()
    kind, hint = next((row for ends, row in KINDS.items() if ending in ends.split()), ("", ""))
    if kind and os.path.isfile(name):
        message = f"{quoted(name)} is {kind}, not the PAG of a product"
        raise usage_error(message, hint.format(*[name] * 2))


def written_out(statements: Statements, findings: Findings) -> list[Definition]:
    """The definitions without copies and places, in which a label is one Token. Errors (Syntax,
    DuplicateLabel, WrongInputs, BadValue) go to the findings."""
    definitions = statements.definitions
    copied = statements.copied
    if not copied and not any(one.places for one in definitions):
        return list(definitions)
    groups = {str(label.name): label.labels() for label in copied}
    wrong = {str(label.name) for label in copied if not 1 <= label.number <= COPIES}
    twice = groups.keys() & {one.label for one in definitions if isinstance(one.label, Token)}
    for name in groups.keys() & (statements.broken | wrong):
        statements.broken.update(groups[name])
    statements.broken |= twice
    made: list[Definition] = []
    for definition in definitions:
        made += _each(_with_groups(definition, groups, findings), findings)
    return made


def _with_groups(
    definition: Definition, groups: Mapping[str, Sequence[Token]], findings: Findings
) -> Definition:
    """A definition in which the name of copies among the inputs is replaced by their labels."""
    label = definition.label
    if not isinstance(label, CopiedLabel) and label in groups:
        message = f"{quoted(label)} is the name of copies, and a label"
        findings.add("DuplicateLabel", message, label, "rename one of the two")
        return definition
    arguments: list[Token | Keyword] = []
    for index, argument in enumerate(definition.arguments):
        twice = argument in definition.arguments[:index]
        if isinstance(argument, Token) and argument in groups and twice:
            message = f"{quoted(argument)} means all its copies, and is there twice"
            hint = f"name it once, or its copies one by one: {argument}[1]"
            findings.add("PagNotTree", message, argument, hint)
        elif isinstance(argument, Token) and argument in groups:
            place = partial(Token.new_borrow_pos, borrow_t=argument)
            arguments += [place("WORD", str(copy)) for copy in groups[argument]]
        else:
            arguments.append(argument)
    return definition._replace(arguments=arguments)


def _each(definition: Definition, findings: Findings) -> list[Definition]:
    """The definitions that a definition with copies or places stands for."""
    labels, places = labels_of(definition.label), definition.places
    if isinstance(definition.label, CopiedLabel):
        _check_copies(definition, definition.label, findings)
    if places is None:
        return [definition._replace(label=label) for label in labels]
    if places.word != "at":
        hint = "a statement ends with ';' behind its last parenthesis; places of copies: "
        message = f"unexpected {quoted(places.word)} after ')'"
        findings.add("Syntax", message, places.word, hint + COPIES_FORM)
    elif len(places.vectors) != len(labels):
        _refuse_places(definition, len(labels), len(places.vectors), findings)
    name = Token.new_borrow_pos("WORD", "pos", places.word)
    last = repeat(places.vectors[-1], len(labels))
    return [
        Definition(label, definition.operation, [*definition.arguments, Keyword(name, vector)])
        for label, vector in zip(labels, chain(places.vectors, last), strict=False)
    ]


def _refuse_places(definition: Definition, labels: int, places: int, findings: Findings) -> None:
    assert definition.places is not None
    label = definition.label
    name = label.name if isinstance(label, CopiedLabel) else label
    copies = f"{labels} cop{'y' if labels == 1 else 'ies'}"
    message = f"{places} place{'s' * (places != 1)} for {copies} of {quoted(name)}"
    hint = f"a place for each copy: {name}[{places}] = {definition.operation} ( ... ) at ..."
    findings.add("BadValue", message, definition.places.word, hint)


def _check_copies(definition: Definition, label: CopiedLabel, findings: Findings) -> None:
    if not 1 <= label.number <= COPIES:
        message = f"{label.name}{label.brackets} is no number of copies"
        hint = f"a whole number from 1 to {COPIES}: {COPIES_FORM}"
        findings.add("BadValue", message, label.brackets, hint)
    inputs = [argument for argument in definition.arguments if isinstance(argument, Token)]
    if inputs:
        message = f"copies of {quoted(label.name)}, which has the input {quoted(inputs[0])}"
        hint = "a sub-assembly is used once, so only parts have copies: write one statement each"
        findings.add("WrongInputs", message, inputs[0], hint)


def allowances_of(
    statements: Statements, nodes: Sequence[Assembly], unit: str, findings: Findings
) -> tuple[AllowedOverlap, ...]:
    """The overlaps that a text allows, with depths in a unit; the name of copies stands for each
    copy. Errors (BadValue, UndefinedLabel) go to the findings."""
    groups = {str(label.name): [*map(str, label.labels())] for label in statements.copied}
    parts = {node.label: not node.inputs for node in nodes}
    overlaps: list[AllowedOverlap] = []
    for permission in statements.permissions:
        overlaps += _allowed(permission, groups, parts, unit, statements.broken, findings)
    return tuple(overlaps)


def _allowed(
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
        findings.add("BadValue", message, last if len(labels) == 2 else permission.word, ALLOW_FORM)
        return
    for label in labels:
        if label not in groups and not parts.get(label) and label not in broken:
            _refuse_label(label, label in parts, [part for part in parts if parts[part]], findings)
            return
    yield from (AllowedOverlap(depth, pair, at) for pair in pairs or [()])


def _refuse_label(label: Token, made: bool, parts: Sequence[str], findings: Findings) -> None:
    if made:
        hint = "name the parts of it that overlap"
        findings.add("BadValue", f"{quoted(label)} is no part, it is made of some", label, hint)
        return
    hint = did_you_mean(label, parts, "parts")
    findings.add("UndefinedLabel", f"there is no part {quoted(label)}", label, hint)
