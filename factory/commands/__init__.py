"""The command line. Each command, a module, reads, calls the stages and writes.

The commands here know the core and what goes with its runs; apps give the others.
"""

from __future__ import annotations

import atexit
import gc
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from difflib import get_close_matches
from functools import cache
from types import MappingProxyType
from typing import Any
from warnings import simplefilter

import click

from factory.commands.defaults import set_in_advance
from factory.support.apps import App, apps, at, shipped
from factory.support.console import STDOUT, emit, fail, say
from factory.support.errors import (
    Diagnostic,
    FactoryError,
    InputError,
    MissingError,
    StoppedError,
    did_you_mean,
    usage_error,
)
from factory.support.extensions import bad_extension, position_of
from factory.support.files import NO_ROOM
from factory.support.guard import guarded
from factory.support.interruption import interrupt, stop_on_signals
from factory.support.version import __version__


def code_names(ctx: click.Context, param: click.Parameter, begun: str) -> list[str]:
    """Completions of --explain in a shell."""
    from factory.support.explanations import codes

    return [code for code in codes() if code.lower().startswith(begun.lower())]


def print_code(code: str, as_json: bool) -> None:
    """Print the meaning of a code, an example that provokes it, and the remedy. Raises InputError
    for an unknown code."""
    from factory.support.explanations import explain

    explanation = explain(code)
    if as_json:
        emit({"code": explanation.code, "title": explanation.title, "text": explanation.text})
    else:
        say(f"{explanation.code}: {explanation.title}\n\n{explanation.text}")


CONTEXT = {"help_option_names": ["-h", "--help"], "max_content_width": 100}


def _leave_to_the_system() -> None:
    """No search for cycles in what goes with the process; but a library that would report what is
    left of its own."""
    if "manifold3d" not in sys.modules:
        gc.freeze()


def main(arguments: Sequence[str] | None = None) -> None:
    """The entry point: runs a command and exits with its status, never with a traceback."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    _open_streams()
    if not sys.warnoptions:  # what libraries warn programmers of is shown with `python -W default`
        simplefilter("ignore")
    stop_on_signals(interrupt)
    atexit.register(_leave_to_the_system)
    status = run_command(words)
    try:
        sys.stdout.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        if not isinstance(error, BrokenPipeError):
            error.filename = STDOUT
            status = fail(_unwritten(error), False)
    try:
        sys.stderr.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    sys.exit(status)


def _open_streams() -> None:
    """Replace closed streams by ones that discard output; characters outside a stream's encoding
    are printed as `?`."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        with suppress(AttributeError):
            getattr(sys, name).reconfigure(errors="replace")


def run_command(words: list[str]) -> int:
    """The exit status of a command line: 0 ok, 1 a check or run failed, 2 bad input, 3 something is
    missing on the machine, 130 interrupted."""
    try:
        with guarded():
            result = cli.main(words, prog_name="factory", standalone_mode=False)
        return result if isinstance(result, int) else 0
    except click.exceptions.Exit as done:
        return done.exit_code
    except (BrokenPipeError, SystemExit):  # click exits where its stdout is closed
        return 0
    except (Exception, KeyboardInterrupt) as error:
        return fail(_refusal(error), "--json" in words)


def _refusal(error: BaseException) -> FactoryError:
    """Any exception as an error for the user."""
    if isinstance(error, FactoryError):
        return error
    if isinstance(error, KeyboardInterrupt | click.Abort):
        return StoppedError(Diagnostic("Interrupted", "stopped by the user"))
    if isinstance(error, click.ClickException):
        return InputError(_usage(error))
    if isinstance(error, ImportError) and not (error.name or "").startswith("factory"):
        return _missing_package(error)
    if isinstance(error, OSError):
        return _unwritten(error)
    if isinstance(error, MemoryError):
        message = f"out of memory{error and f': {error}'}"
        return MissingError(Diagnostic("Missing", message, None, "take a smaller product"))
    if isinstance(error, RecursionError):
        message = "the input is nested too deeply"
        return InputError(Diagnostic("Syntax", message, None, "flatten it"))
    if os.environ.get("FACTORY_TRACEBACK"):
        raise error
    message = f"{type(error).__name__}: {error}"
    hint = "a bug in factory: please report it, with the output of FACTORY_TRACEBACK=1"
    return InputError(Diagnostic("Internal", message, None, hint))


def _usage(error: click.ClickException) -> Diagnostic:
    """A usage error of click as a diagnostic."""
    if isinstance(error, click.BadParameter) and (fault := set_in_advance(error)):
        return fault
    context = getattr(error, "ctx", None)
    hint = f"see {context.command_path if context else 'factory'} --help"
    message = error.format_message()
    if isinstance(error, click.MissingParameter) and isinstance(error.param, click.Option):
        hint = f"{error.param.opts[0]}: {error.param.help} ({hint})"
    if isinstance(error, click.exceptions.NoSuchOption):
        message = f"there is no option '{error.option_name}'"
        words = {option.lstrip("-"): option for option in error.possibilities or ()}
        # dashes, which all options have, do not make two alike
        if near := get_close_matches(error.option_name.lstrip("-"), words, n=1):
            hint = f"did you mean '{words[near[0]]}'?"
    return Diagnostic("Usage", message, None, hint)


def _missing_package(error: ImportError) -> MissingError:
    name = (error.name or "").partition(".")[0] or "a package"
    message = f"the Python package '{name}' cannot be imported: {error}"
    return MissingError(Diagnostic("Missing", message, None, f"pip install {name}"))


def _unwritten(error: OSError) -> InputError:
    where = f"{error.filename}: " if error.filename else ""
    message = f"{where}{error.strerror or error}"
    return InputError(Diagnostic("BadFile", message, None, NO_ROOM))


MEANT = {
    word: command
    for command, words in {
        "--help": "help man usage",
        "run": "simulate sim start play execute go",
        "build": "compile make layout mjcf",
        "check": "verify prove validate lint test",
        "plant": "opcua plc",
        "view": "show gui visualize visualise open watch live",
        "render": "film video draw picture movie",
        "new": "init create start-project template",
        "export": "convert save",
        "doctor": "version info status",
    }.items()
    for word in words.split()
}
"""The command that a mistaken word probably means."""


OWN = App(
    "commands",
    commands={
        name: f"factory.commands.{name}:{name}"
        for name in ("build", "check", "doctor", "new", "programs", "render", "run", "templates")
    },
)
"""The commands that need the core, and what goes with its runs."""


@cache
def places() -> Mapping[str, str]:
    """The places of all commands, by their names in order. Raises InputError (BadExtension) for a
    name that two apps give."""
    by_name = dict[str, str]()
    for app in (OWN, *apps().values()):
        for name, place in app.commands.items():
            if name in by_name:
                message = f"the app '{app.name}' gives the command '{name}', which is there already"
                raise bad_extension(message, None)
            by_name[name] = place
    return MappingProxyType(dict(sorted(by_name.items())))


def _tables() -> Iterator[Mapping[str, str]]:
    """Tables in which a command is looked up, the next one only where the one before has it not:
    what is called is found without what other packages give."""
    yield OWN.commands
    yield from (app.commands for app in shipped().values())
    yield places()


def commands() -> dict[str, click.Command]:
    """All commands by their names, loaded. Raises InputError (BadExtension)."""
    return {name: _loaded(name, place) for name, place in places().items()}


def _loaded(name: str, place: str) -> click.Command:
    made = at(place)
    if not isinstance(made, click.Command):
        message = f"the command '{name}' of an app is no click.Command: {place}"
        raise bad_extension(message, position_of(made))
    return made


class _Commands(click.Group):
    """A group that loads the command that is called alone, and suggests the nearest one."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return [*places()]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """A command by its name, loaded; None where there is none. Raises InputError
        (BadExtension)."""
        place = next((table[cmd_name] for table in _tables() if cmd_name in table), None)
        return _loaded(cmd_name, place) if place else None

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            meant = MEANT.get(args[0].lower().lstrip("-"), "")
            hint = did_you_mean(args[0], self.list_commands(ctx), "commands")
            if args[0].endswith(".pag"):
                hint = f"the command comes first: factory run {args[0]}"
            elif meant:
                hint = f"did you mean 'factory {meant}'?"
            message = f"there is no command '{args[0]}'"
            raise usage_error(message, hint) from error


@click.group(cls=_Commands, context_settings=CONTEXT, invoke_without_command=True)
@click.option("--version", is_flag=True, help="Show the version and exit.")
@click.option(
    "--explain",
    metavar="CODE",
    shell_complete=code_names,
    help="Explain the code of an error and exit.",
)
@click.option("--json", "as_json", is_flag=True, hidden=True)
@click.pass_context
def cli(ctx: click.Context, version: bool, explain: str | None, as_json: bool) -> None:
    """Compile a product assembly graph (PAG) into a factory, prove it live, run it in MuJoCo."""
    if version:
        emit({"version": __version__}) if as_json else say(f"factory {__version__}")
        ctx.exit()
    if explain is not None:
        print_code(explain, as_json)
        ctx.exit()
    if ctx.invoked_subcommand is None:
        if not as_json:
            click.echo(ctx.get_help() + "\n", err=True)
        raise click.UsageError("there is no command", ctx)
    if as_json:
        raise click.UsageError("--json comes after the command", ctx)


__all__ = ["cli", "commands", "main", "run_command"]
