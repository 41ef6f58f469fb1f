"""Sphinx extension: the pages of the reference, written from the code before each build.

`PAGES` has a function for each page, from nothing to Markdown. A page is written to
docs/reference/NAME.md only where it has changed; git ignores them, so none can be stale.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping
from inspect import isclass, isfunction, ismodule, signature, unwrap
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from reference_text import code, definition, heading, prose, table

from factory import api
from factory.apps.exports import exporters
from factory.commands import cli
from factory.commands import commands as every_command
from factory.floor.robots.catalogue import load_catalogue
from factory.support.explanations import codes, explain
from factory.support.resources import mjcf_folder
from factory.support.settings import Settings
from factory.support.user_defaults import OPTIONS
from factory.theory.lang.template_reader import all_templates
from factory.theory.problem.parameters import WRITTEN

if TYPE_CHECKING:
    from sphinx.application import Sphinx

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "factory"

CALLS = (
    *("load_pag", "compile", "verify", "lay_out", "run", "build", "render", "report", "analyze"),
    *("export", "sweep", "plan", "pareto", "fidelity", "revise", "to_networkx"),
)
VALUES = (
    *("support.settings.Settings", "theory.problem.pag.PAG", "theory.problem.pag.Assembly"),
    *("theory.problem.template.Template", "theory.plant.factory.Factory"),
    *("theory.plant.factory.Operation", "theory.plant.robot.Robot"),
    *("theory.nets.verdict.Verdict", "floor.layout.layout.Layout", "engine.simulation.run.Run"),
    *("engine.record.figures.PhysicsFigures", "apps.exports.build.Built"),
    *("apps.runs.pictures.Rendered", "apps.report.page.RunReport"),
    *("apps.analyze.analysing.Analysis", "apps.sweep.summary.Summary"),
    *("studies.PlannedAssembly", "apps.pareto.front.ParetoFront"),
    *("apps.revise.revision.Revision", "apps.fidelity.record.Fidelity"),
)
"""What the calls take and give."""

ERRORS = ("FactoryError", "InputError", "MissingError", "RunError", "Diagnostic")


def commands() -> str:
    """Every command with its options, as click knows them."""
    top = click.Context(cli, info_name="factory", **cli.context_settings)
    shared = {p.name for p in every_command()["doctor"].params}
    lines = [heading(1, "Commands"), prose(cli.help or "")]
    lines.append(
        "Every command takes `--json` (one document on stdout), `-q`, `-v`, `-h` (the common "
        "options) and `--help` (all). Exit status: 0 ok, 1 a check or run failed, 2 bad input, "
        "3 something missing on the machine, 130 interrupted. `factory --version` and "
        "`factory --explain CODE` stand alone."
    )
    for name, command in every_command().items():
        context = click.Context(command, top, info_name=name)
        lines += [heading(2, f"factory {name}"), prose(command.help or "")]
        lines.append(code(" ".join([context.command_path, *command.collect_usage_pieces(context)])))
        records = [
            option.get_help_record(context)
            for option in command.params
            if option.name not in shared and isinstance(option, click.Option)
        ]
        rows = [(f"`{names}`", prose(words)) for names, words in filter(None, records)]
        if rows:
            lines.append(table(("option", "meaning"), rows))
    return "\n\n".join(lines)


def settings() -> str:
    """The settings with their ranges, and the options that have defaults of a user's own."""
    built_in = Settings()
    rows = [
        (f"`{name}`", built(getattr(built_in, name)), f"{low:g} to {high:g}", variable(name))
        for name, (low, high) in Settings.RANGES.items()
    ]
    shared = [(f"`{k}`", f"`{example!r}`", variable(k)) for k, example in OPTIONS.items()]
    return "\n\n".join(
        [
            heading(1, "Settings"),
            prose(docstring(Settings)),
            table(("setting", "built in", "range", "in the environment"), rows),
            "An option comes before the environment, that before the `factory.toml` beside the "
            "PAG, or else in the current folder, that before what is built in. These options may "
            "stand there too:",
            table(("option", "for example", "in the environment"), shared),
        ]
    )


def built(value: float | str | None) -> str:
    """The value that a setting has where none is given."""
    return f"{value:g}" if isinstance(value, float | int) else value or "by the timestep"


def variable(name: str) -> str:
    """The environment variable of a setting or option."""
    return f"`FACTORY_{name.upper()}`"


def language() -> str:
    """The languages of PAGs and templates: their grammars, and what parts may say."""
    rows = [(f"`{name}`", f"{kind.wanted}", f"`{kind.example}`") for name, kind in WRITTEN.items()]
    return "\n\n".join(
        [
            heading(1, "The PAG language"),
            "What a text means is told in [the theory of PAGs](../theory/pag.md). Lengths are "
            "metres, or of the unit that the text says; `quat` is (w, x, y, z), `turn` in degrees "
            "about x, then y, then z of the product; a colour may be a name of CSS; `box` has its "
            "three sides, `cylinder` radius and height, `sphere` its radius.",
            heading(2, "Geometry of a part"),
            "The parameters of `atomic`, and of every operation with `parameters = geometry`.",
            table(("parameter", "value", "for example"), rows),
            heading(2, "Grammar of a PAG"),
            code((PACKAGE / "theory" / "lang" / "pag.lark").read_text("utf-8")),
            heading(2, "Grammar of a template"),
            code((PACKAGE / "theory" / "lang" / "template.lark").read_text("utf-8")),
            "Both are read by [Lark](https://github.com/lark-parser/lark), in the form given here.",
        ]
    )


def operations() -> str:
    """The shipped operations, each as its file has it."""
    lines = [
        heading(1, "Operations"),
        "What `factory templates` lists: the files of `templates/`. "
        "[The tutorial](../tutorial.md) makes one more, [Templates](../theory/templates.md) tells "
        "what the clauses mean.",
    ]
    for name, template in sorted(all_templates().items()):
        inputs = len(template.inputs)
        more = " or more" if template.further else ""
        lines += [
            heading(2, name),
            f"Inputs: {inputs}{more}. Robots: {', '.join(f'`{r}`' for r in template.robots)}.",
            code((ROOT / "templates" / f"{name}.op").read_text("utf-8")),
        ]
    return "\n\n".join(lines)


def diagnostics() -> str:
    """What every code of a diagnostic means, and how it is mended."""
    lines = [
        heading(1, "Diagnostics"),
        "Errors and warnings have a code, the place in the user's own text, what was found, and "
        "what would have been right. `factory --explain CODE` says what is written here.",
    ]
    for name in codes():
        found = explain(name)
        lines += [heading(2, name), f"*{prose(found.title)}*", definition(found.text)]
    return "\n\n".join(lines)


def log_format() -> str:
    """The log of a run, as the package that writes and reads it describes it."""
    from factory.apps import log
    from factory.apps.log import blocks

    return "\n\n".join(
        [
            heading(1, "The log of a run"),
            definition(docstring(log)),
            heading(2, "Blocks"),
            definition(docstring(blocks)),
            "`factory export LOG --format csv`, `mcap` or `usd` makes other files of "
            "it; `factory.apps.log.read_log` reads it in Python.",
        ]
    )


def robots() -> str:
    """The robot types: the catalogue, and the MJCF of each."""
    lines = [
        heading(1, "Robot types"),
        "The files of `mjcf/`. A type is an MJCF file and an entry of the catalogue.",
    ]
    for name, robot in load_catalogue().types.items():
        extends = f" Extends `{robot.extends}`." if robot.extends else ""
        lines += [
            heading(2, name),
            f"{prose(robot.summary).capitalize()}.{extends}",
            code(robot.mjcf.read_text("utf-8"), "xml"),
        ]
    catalogue = (mjcf_folder() / "catalogue.toml").read_text("utf-8")
    return "\n\n".join([*lines, heading(2, "The catalogue"), code(catalogue, "toml")])


def formats() -> str:
    """What `factory export` writes, as every exporter says of itself."""
    rows = [(f"`{e.format}`", e.takes, prose(e.summary)) for e in exporters().values()]
    return "\n\n".join(
        [
            heading(1, "File formats"),
            "What `factory export FILE --format F` writes. [Exports](../exports.md) shows who has "
            "read them back.",
            table(("format", "made of", "what it is"), rows),
            "`factory import` reads LDraw models, trees of meshes and bills of materials: see "
            "[Importing](../importing.md). The log has [a page of its own](log.md).",
        ]
    )


def python() -> str:
    """The public names of `factory`, by autodoc."""
    calls = [f".. autofunction:: factory.{name}" for name in CALLS]
    values = [f".. autoclass:: factory.{name}" for name in VALUES]
    errors = [f".. autoclass:: factory.support.errors.{name}" for name in ERRORS]
    return "\n\n".join(
        [
            heading(1, "Python"),
            "`import factory` loads no engine.",
            directive(".. automodule:: factory"),
            heading(2, "Calls"),
            directive(*calls),
            heading(2, "Values"),
            "Frozen, checked when made.",
            directive(*(f"{value}\n   :members:" for value in values)),
            heading(2, "Errors"),
            directive(*errors),
        ]
    )


def interface() -> str:
    """The names of `factory.api`, each with the docstring at its definition."""
    lines = [heading(1, "Interface"), prose(docstring(api))]
    for home, names in api.HOMES.items():
        for name in names.split():
            subject = unwrap(getattr(api, name))
            lines.append(heading(2, name))
            if isfunction(subject):
                lines.append(code(f"{name}{signature(subject)}", "python"))
            plain = isclass(subject) or isfunction(subject) or ismodule(subject)
            lines.append(definition(docstring(subject) if plain else remark(home, name)))
            lines.append(f"*`factory/{home.replace('.', '/')}.py`*")
    return "\n\n".join(lines)


def remark(home: str, name: str) -> str:
    """The text below the definition of a constant or of the name of a type."""
    body = ast.parse((PACKAGE / f"{home.replace('.', '/')}.py").read_text("utf-8")).body
    for node, after in pairwise(body):
        targets = node.targets if isinstance(node, ast.Assign) else []
        if any(isinstance(target, ast.Name) and target.id == name for target in targets):
            assert isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
            return str(after.value.value)
    raise LookupError(f"{home} does not define {name}")


def directive(*texts: str) -> str:
    """A block of directives in Sphinx's own language."""
    return "\n".join(["```{eval-rst}", "\n\n".join(texts), "```"])


def docstring(subject: Any) -> str:
    """The docstring of a module or class, without its margin."""
    from inspect import getdoc

    return getdoc(subject) or ""


PAGES: Mapping[str, Callable[[], str]] = {
    "commands": commands,
    "settings": settings,
    "language": language,
    "operations": operations,
    "diagnostics": diagnostics,
    "formats": formats,
    "log": log_format,
    "robots": robots,
    "python": python,
    "interface": interface,
}


def write_pages(app: Sphinx) -> None:
    """Every page whose text has changed."""
    for name, page in PAGES.items():
        path = Path(app.srcdir) / "reference" / f"{name}.md"
        text = page() + "\n"
        if not path.exists() or path.read_text("utf-8") != text:
            path.write_text(text, "utf-8")


def literals(
    app: Sphinx, kind: str, name: str, subject: Any, options: Any, lines: list[str]
) -> None:
    """Docstrings here mark code by single backticks, Sphinx takes two."""
    text = re.sub(r"(?<!`)`([^`\n]+)`(?!`)", r"``\1``", "\n".join(lines))
    lines[:] = text.split("\n")


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("builder-inited", write_pages)
    app.connect("autodoc-process-docstring", literals)
    return {"parallel_read_safe": True}
