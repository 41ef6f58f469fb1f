"""Defaults of options: from the environment, or from the `factory.toml` for a FILE."""

from __future__ import annotations

from pathlib import Path

import click
from click.core import ParameterSource

from factory.commands.requests import PLANNED
from factory.support.errors import Diagnostic

PARAMETERS = {"templates": "folders"}
"""Names of parameters that are not those of their options."""

META = "factory.toml"
"""The key of the defaults in a click context."""


def with_defaults(command: click.Command) -> click.Command:
    """The command, whose options that are not given are taken from the environment (FACTORY_UNITS
    and so on), or else from the `factory.toml` for its FILE."""
    from factory.support.user_defaults import OPTIONS

    parameters = {parameter.name: parameter for parameter in command.params}
    for key in OPTIONS:
        if parameter := parameters.get(PARAMETERS.get(key, key)):
            parameter.envvar = f"FACTORY_{key.upper()}"
    parameters["file"].callback = _read
    return command


def _read(context: click.Context, parameter: click.Parameter, file: Path) -> Path:
    """FILE itself; values of its `factory.toml` become the defaults of all other options. Raises
    InputError."""
    from factory.support.files import is_plan
    from factory.support.user_defaults import defaults_for

    defaults = context.meta[META] = defaults_for(file)
    planned = PLANNED if is_plan(file) else {}
    named = {PARAMETERS.get(key, key): value for key, value in defaults.options().items()}
    context.default_map = {key: value for key, value in named.items() if key not in planned}
    return file


def set_in_advance(error: click.BadParameter) -> Diagnostic | None:
    """Error of a bad value from the environment or from `factory.toml`, with its place; None if it
    was given as an option."""
    parameter, context = error.param, error.ctx
    if parameter is None or context is None or not parameter.name:
        return None
    source = context.get_parameter_source(parameter.name)
    if source is ParameterSource.ENVIRONMENT:
        message = f"{error.format_message()} It is in the environment: {parameter.envvar}."
        return Diagnostic("Usage", message, None, f"see {context.command_path} --help")
    if source is ParameterSource.DEFAULT_MAP:
        key = next((k for k, name in PARAMETERS.items() if name == parameter.name), parameter.name)
        return Diagnostic("BadValue", f"{key}: {error.message}", context.meta[META].at(key))
    return None
