"""Options that a user has set beforehand: in the environment, or in `factory.toml`."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from factory.support.errors import Diagnostic, InputError

PARAMETERS = {"templates": "folders"}
"""Names of parameters that are not those of their options."""


def with_defaults(command: click.Command) -> click.Command:
    """A command on a FILE whose options may be set by FACTORY_UNITS and so on, and by the
    `factory.toml` for that file, in this order, where they are not given."""
    from factory.support.user_defaults import OPTIONS

    options = {p.name: p for p in command.params if isinstance(p, click.Option)}
    own = {key: p for key in OPTIONS if (p := options.get(PARAMETERS.get(key, key)))}
    for key, parameter in own.items():
        parameter.envvar = f"FACTORY_{key.upper()}"
    if command.callback is not None:
        command.callback = _filled(command.callback, own)
    return command


def from_environment(error: click.BadParameter) -> str:
    """Which variable a bad value comes from; "" where it was given as an option."""
    parameter, context = error.param, error.ctx
    if parameter is None or context is None or not parameter.name or not parameter.envvar:
        return ""
    if context.get_parameter_source(parameter.name) is not ParameterSource.ENVIRONMENT:
        return ""
    return f" It is in the environment: {parameter.envvar}."


def _filled(call: Callable[..., Any], own: dict[str, click.Option]) -> Callable[..., Any]:
    @wraps(call)
    def filled(**given: Any) -> Any:
        from factory.support.user_defaults import defaults_for

        context = click.get_current_context()
        defaults = defaults_for(Path(given["file"]))
        for key, value in defaults.options().items():
            parameter = own.get(key)
            name = parameter.name if parameter else None
            if parameter is None or name is None:
                continue
            if context.get_parameter_source(name) is not ParameterSource.DEFAULT:
                continue
            try:
                given[name] = parameter.type_cast_value(context, value)
            except click.BadParameter as error:
                fault = Diagnostic("BadValue", f"{key}: {error.message}", defaults.at(key))
                raise InputError(fault) from None
        return call(**given)

    return filled
