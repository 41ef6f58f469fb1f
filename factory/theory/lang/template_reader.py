"""From text to template, and all templates of some folders.

A template that is returned has one label per robot before and after, one carrier that ends up with
the result, one input for each sub-assembly, and a goal for each robot (Definition 4.1): the nets
made of such templates are those of Theorem 5.1.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType

from factory.support.errors import Diagnostic, InputError, Position, did_you_mean
from factory.support.extensions import extension_folders
from factory.support.resources import templates_folder
from factory.support.texts import Findings, quoted, source_of
from factory.theory.lang.source import read_text
from factory.theory.lang.template_checks import TemplateMaker
from factory.theory.lang.template_syntax import read_clauses
from factory.theory.problem.pag import NOPART
from factory.theory.problem.template import Template

Folder = str | os.PathLike[str]


@lru_cache(maxsize=256)
def read_template(text: str, file: str = "<text>") -> Template:
    """The template of a text. `load_templates` checks the templates named by `further`, `instead`
    and `brought`. A text is parsed once a process.

    Args:
        text: the text.
        file: the name of its file.

    Raises InputError with every error of the text.
    """
    findings = Findings(source_of(text, file))
    template = TemplateMaker(read_clauses(findings), findings).make()
    findings.raise_if_any()
    if template is None:
        raise AssertionError("a draft without errors gives a template")
    return template


def is_shipped(template: Template) -> bool:
    """Whether a template is one of the package's, which have a mode in every layout."""
    at = template.position
    return at is not None and Path(at.file).parent == templates_folder()


def all_templates(folders: Sequence[Folder] = ()) -> Mapping[str, Template]:
    """The templates of the user's folders, of entry points and the shipped ones.

    Args:
        folders: those of the user, searched first.

    Raises InputError.
    """
    for folder in folders:
        if not Path(folder).is_dir():
            message = f"the templates folder '{folder}' is no directory"
            raise InputError(
                Diagnostic("BadTemplate", message, None, "--templates takes a directory")
            )
    every = *map(Path, folders), *extension_folders("templates"), templates_folder()
    return load_templates(every)


def load_templates(folders: Sequence[Folder]) -> Mapping[str, Template]:
    """The templates of all `*.op` files in some folders, by name, in the order of the search.

    In each folder the files are read in sorted order; where two folders have a template of the
    same name, the first folder's counts. Raises InputError with every error of every file.
    """
    merged: dict[str, Template] = {}
    diagnostics: list[Diagnostic] = []
    for folder in folders:
        here: dict[str, Template] = {}
        for template in _templates_in(folder, diagnostics):
            if template.name in here:
                diagnostics.append(_twice(template, here[template.name]))
            here.setdefault(template.name, template)
        merged |= {name: t for name, t in here.items() if name not in merged}
    if not diagnostics:
        diagnostics.extend(_check_others(merged))
    if diagnostics:
        raise InputError(diagnostics)
    return MappingProxyType(merged)


def _templates_in(folder: Folder, diagnostics: list[Diagnostic]) -> Iterator[Template]:
    try:
        names = sorted(name for name in os.listdir(folder) if name.endswith(".op"))
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or str(error)
        message = f"the templates in {quoted(os.fspath(folder))} cannot be read: {why}"
        at = Position(os.fspath(folder), 1, 1)
        hint = "give a folder that holds templates (*.op)"
        diagnostics.append(Diagnostic("BadFile", message, at, hint))
        return
    for name in names:
        path = str(Path(folder) / name)
        try:
            yield read_template(read_text(path), path)
        except InputError as error:
            diagnostics.extend(error.diagnostics)


def _twice(second: Template, first: Template) -> Diagnostic:
    message = f"the template {quoted(second.name)} is defined twice, first at {first.position}"
    return Diagnostic("BadTemplate", message, second.position, "rename one of the two")


def _check_others(templates: Mapping[str, Template]) -> Iterator[Diagnostic]:
    """Errors of the templates that others name as `further`, `instead` or `brought`."""
    for template in templates.values():
        to = quoted(template.name)
        at = template.brought_position or template.position
        why = f"hands nothing over to {to}"
        yield from _check_other(template.brought, at, why, templates, handed_over=True)
        at = template.further_position or template.position
        why = "cannot take further inputs one by one"
        yield from _check_other(template.further, at, why, templates)
        at, why = template.instead_position or template.position, f"cannot stand for {to}"
        yield from _check_other(template.instead, at, why, templates)
        other = templates.get(template.instead, template)
        lacking = {name for name, _ in template.parameters}
        lacking -= {name for name, _ in other.parameters}
        if lacking:
            message = f"{quoted(other.name)} {why}: it has no {', '.join(sorted(lacking))}"
            hint = "give it the same parameters, with their defaults"
            yield Diagnostic("BadTemplate", message, at, hint)


def _check_other(
    name: str,
    at: Position | None,
    why: str,
    templates: Mapping[str, Template],
    handed_over: bool = False,
) -> Iterator[Diagnostic]:
    """Errors of a template, if one is named, that must take one input in addition to that of its
    carrier, or by which an input is to be handed over to its carrier."""
    other = templates.get(name)
    if name and other is None:
        hint = did_you_mean(name, list(templates), "templates")
        yield Diagnostic("BadTemplate", f"there is no template {quoted(name)}", at, hint)
    elif other and (len(other.inputs), other.held == NOPART) != (2 - handed_over, handed_over):
        hint = "that takes two inputs, one of which its carrier brings, as insert does"
        if handed_over:
            hint = "that takes one input, which another robot brings to its carrier, as pick does"
        yield Diagnostic("BadTemplate", f"{quoted(name)} {why}", at, hint)
