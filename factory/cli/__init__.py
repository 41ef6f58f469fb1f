"""The command line: thin. Each command reads, calls the stages and writes; see the README."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import Any

import click

from factory import __version__
from factory.cli.make import build
from factory.cli.move import render, run
from factory.cli.prove import check, export, programs
from factory.cli.tell import doctor, templates
from factory.console import fail
from factory.errors import Diagnostic, FactoryError, InputError, MissingError, did_you_mean

CONTEXT = {"help_option_names": ["-h", "--help"], "max_content_width": 100}


def main(arguments: Sequence[str] | None = None) -> None:
    """The entry point: runs a command and exits with its status, never with a traceback."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    status = run_command(words)
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    sys.exit(status)


def run_command(words: list[str]) -> int:
    """The exit status of a command line: 0 ok, 1 a check or run failed, 2 bad input, 3 something is
    missing on the machine, 130 interrupted."""
    as_json = "--json" in words
    try:
        result = cli.main(words, prog_name="factory", standalone_mode=False)
        return result if isinstance(result, int) else 0
    except click.exceptions.Exit as done:
        return done.exit_code
    except click.ClickException as error:
        return fail(InputError(_usage(error)), as_json)
    except FactoryError as error:
        return fail(error, as_json)
    except (KeyboardInterrupt, click.Abort):
        return fail(_Interrupted(Diagnostic("Interrupted", "stopped by the user")), as_json)
    except BrokenPipeError:
        return 0
    except ImportError as error:
        return fail(_missing_package(error), as_json)
    except OSError as error:
        message = f"{error.filename or 'the system'}: {error.strerror or error}"
        hint = "check the path, its permissions and the space on the disk"
        return fail(InputError(Diagnostic("File", message, None, hint)), as_json)
    except RecursionError:
        message = "the input is nested too deeply"
        return fail(InputError(Diagnostic("Syntax", message, None, "flatten it")), as_json)


class _Interrupted(FactoryError):
    exit_status = 130


def _usage(error: click.ClickException) -> Diagnostic:
    """A usage error of click as a diagnostic."""
    hint = "see factory --help"
    context = getattr(error, "ctx", None)
    if context is not None:
        hint = f"see {context.command_path} --help"
    if isinstance(error, click.exceptions.NoSuchOption) and error.possibilities:
        hint = f"did you mean '{sorted(error.possibilities)[0]}'?"
    return Diagnostic("Usage", error.format_message().replace("\n", " "), None, hint)


def _missing_package(error: ImportError) -> MissingError:
    name = (error.name or "").partition(".")[0] or "a package"
    message = f"the Python package '{name}' cannot be imported: {error}"
    return MissingError(Diagnostic("Missing", message, None, f"pip install {name}"))


class _Commands(click.Group):
    """A group that suggests the nearest command."""

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            hint = did_you_mean(args[0], list(self.commands), "commands")
            raise InputError(Diagnostic("Usage", error.format_message(), None, hint)) from error


@click.group(cls=_Commands, context_settings=CONTEXT)
@click.version_option(__version__, prog_name="factory")
def cli() -> None:
    """Compile a product assembly graph (PAG) into a factory, prove it live, run it in MuJoCo."""


for _command in (check, build, run, render, programs, export, templates, doctor):
    cli.add_command(_command)

__all__ = ["cli", "main", "run_command"]
