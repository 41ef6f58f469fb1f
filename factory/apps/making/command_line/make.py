"""`factory make`: plan, check, run, film and report, one after the other."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import click

from factory.commands.options import OUT, OUTPUT, PATH, SECONDS, UNITS
from factory.commands.outputs import writable_folder
from factory.commands.requests import OutputOptions
from factory.support.console import emit, say
from factory.support.errors import MissingError, StoppedError

MEND = {
    "plan": "decide what it asks, and give that to `factory plan SOURCE -o {folder}`; then",
    "check": "correct {pag}, or allow what it names; then",
    "run": "see why: factory report {log} -o {page}; correct {pag}, and then",
    "render": "install what is missing, and then",
    "report": "then",
}
"""What a person does where a step has stopped."""


@dataclass(frozen=True, slots=True)
class MakeStep:
    """A command of the way: its words, and whether the way goes on without what it needs."""

    words: tuple[str, ...]
    optional: bool = False

    @property
    def name(self) -> str:
        """The command."""
        return self.words[0]

    def __str__(self) -> str:
        return shlex.join(("factory", *self.words))


@click.command()
@click.argument("source", type=PATH)
@click.option("-o", "--output", type=OUT, help="Output folder (default: NAME-made).")
@click.option("--units", type=UNITS, default=3, help="Number of products to make and film.")
@click.option("--unit", help="Unit of the lengths in SOURCE, as in `plan` (default: detected).")
@click.option("--seconds", type=SECONDS, help="Time to search for a better tree [s].")
@OUTPUT
def make(
    out: OutputOptions,
    source: Path,
    output: Path | None,
    units: int,
    unit: str | None,
    seconds: float | None,
) -> int:
    """Go from CAD to a film of its factory, in one command.

    Does `plan`, `check`, `run`, `render` and `report`, and prints each as you would call it. SOURCE
    is what `plan` takes, or a PAG, whose assembly tree is kept. It stops where you have to decide
    something, and says which command goes on.
    """
    folder = output or Path(f"{source.stem}-made")
    writable_folder(folder)
    options = ["--unit", unit] if unit else []
    options += ["--seconds", f"{seconds:g}"] if seconds else []
    done: list[dict[str, Any]] = []
    for step in _steps(source, folder, units, options):
        status, printed = _carried_out(step, out)
        done.append({"command": str(step), "status": status, **printed})
        if status and not (step.optional and status == MissingError.exit_status):
            break
    else:
        status, step = 0, None
    files = sorted(str(path) for path in folder.rglob("*") if path.is_file())
    if out.as_json:
        stopped = step.name if step else None
        emit({"folder": str(folder), "steps": done, "stopped": stopped, "files": files})
    elif step is not None:
        what = "" if status == StoppedError.exit_status else MEND[step.name]
        say(f"stopped at `factory {step.name}`: {_going_on(what, step, source, folder)}")
    else:
        say(f"all files are in {folder}: begin with the film and the page")
    return status


def _steps(source: Path, folder: Path, units: int, options: list[str]) -> Iterator[MakeStep]:
    """The commands, each made when those before it are done."""
    pag = source
    if source.suffix != ".pag":
        yield MakeStep(("plan", str(source), "-o", str(folder), *options))
        pag = _planned(folder) or source
    log, film, page = (folder / f"{pag.stem}{end}" for end in (".log", ".mp4", ".html"))
    yield MakeStep(("check", str(pag)))
    folder.mkdir(parents=True, exist_ok=True)
    yield MakeStep(("run", str(pag), "--units", str(units), "--log", str(log)))
    yield MakeStep(("render", str(log), "-o", str(film)), optional=True)
    yield MakeStep(("report", str(log), "-o", str(page)))


def _carried_out(step: MakeStep, out: OutputOptions) -> tuple[int, dict[str, Any]]:
    """The exit status of a command, and with `--json` the errors that it printed."""
    from factory.commands import run_command

    words = [*step.words, *(["-q"] if out.silent else []), *(["-v"] if out.verbose else [])]
    if not out.as_json:
        say(f"$ {step}")
        return run_command(words), {}
    with redirect_stdout(StringIO()) as stream:
        status = run_command([*step.words, "--json"])
    document = json.loads(stream.getvalue() or "{}")
    return status, {"errors": document["errors"]} if "errors" in document else {}


def _planned(folder: Path) -> Path | None:
    """The PAG in a folder that was written last."""
    return max(folder.glob("*.pag"), key=lambda path: path.stat().st_mtime, default=None)


def _going_on(what: str, step: MakeStep, source: Path, folder: Path) -> str:
    """What to do where a step has stopped, and the command that goes on."""
    pag = source if source.suffix == ".pag" or step.name == "plan" else _planned(folder) or source
    files = {end: folder / f"{pag.stem}.{name}" for end, name in (("log", "log"), ("page", "html"))}
    again = shlex.join(("factory", "make", str(pag), "-o", str(folder)))
    return f"{what.format(folder=folder, pag=pag, **files)} {again}".strip()
