"""Copies of a part: `screw[4] = atomic ( ... ) at ( 0, 0, 0 ), ...` is four definitions, and its
name among the inputs of an operation is all four."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import chain, repeat

from lark import Token

from factory.lang.source import Findings, quoted
from factory.lang.statements import COPIES, CopiedLabel, Definition, Keyword, Statements, labels_of

HOW = "screw[2] = atomic ( ... ) at ( 0, 0, 0 ), ( 0, 0, 0.1 )"


def written_out(statements: Statements, findings: Findings) -> list[Definition]:
    """The definitions without copies and places, in which a label is one Token. Errors (Syntax,
    DuplicateLabel, WrongInputs, BadValue) go to the findings."""
    definitions = statements.definitions
    if not any(isinstance(one.label, CopiedLabel) or one.places for one in definitions):
        return list(definitions)
    copied = [one.label for one in definitions if isinstance(one.label, CopiedLabel)]
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
    """A definition with the labels of copies in the place of their name among its inputs."""
    label = definition.label
    if not isinstance(label, CopiedLabel) and label in groups:
        message = f"{quoted(label)} is the name of copies, and a label"
        findings.add("DuplicateLabel", message, label, "rename one of the two")
        return definition
    arguments: list[Token | Keyword] = []
    for number, argument in enumerate(definition.arguments):
        twice = argument in definition.arguments[:number]
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
    """The definitions that one with copies, or with places, stands for."""
    labels, places = labels_of(definition.label), definition.places
    if isinstance(definition.label, CopiedLabel):
        _check_copies(definition, definition.label, findings)
    if places is None:
        return [definition._replace(label=label) for label in labels]
    if places.word != "at":
        hint = f"a statement ends with ';' behind its last parenthesis; places of copies: {HOW}"
        findings.add("Syntax", f"unexpected {quoted(places.word)} after ')'", places.word, hint)
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
        hint = f"a whole number from 1 to {COPIES}: {HOW}"
        findings.add("BadValue", message, label.brackets, hint)
    inputs = [argument for argument in definition.arguments if isinstance(argument, Token)]
    if inputs:
        message = f"copies of {quoted(label.name)}, which has the input {quoted(inputs[0])}"
        hint = "a sub-assembly is used once, so only parts have copies: write one statement each"
        findings.add("WrongInputs", message, inputs[0], hint)
