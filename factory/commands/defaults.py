"""Options that a user sets in advance: in the environment, or in `factory.toml`."""

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
    """A command on a FILE whose options may be set by FACTORY_UNITS and so on, and by the
    `factory.toml` for that file, in this order, where they are not given."""
    from factory.support.user_defaults import OPTIONS

    parameters = {parameter.name: parameter for parameter in command.params}
    for key in OPTIONS:
        if parameter := parameters.get(PARAMETERS.get(key, key)):
            parameter.envvar = f"FACTORY_{key.upper()}"
    parameters["file"].callback = _read
    return command


def _read(context: click.Context, parameter: click.Parameter, file: Path) -> Path:
    """FILE itself; what its `factory.toml` says is the default of the options after it, which are
    all that are not given. Raises InputError."""
    from factory.support.files import is_plan
    from factory.support.user_defaults import defaults_for

    defaults = context.meta[META] = defaults_for(file)
    planned = PLANNED if is_plan(file) else {}
    named = {PARAMETERS.get(key, key): value for key, value in defaults.options().items()}
    context.default_map = {key: value for key, value in named.items() if key not in planned}
    return file


def set_in_advance(error: click.BadParameter) -> Diagnostic | None:
    """The fault of a bad value that was not given as an option: where it is set."""
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
