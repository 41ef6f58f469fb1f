"""Optional packages: the extras of this one."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from factory.support.errors import Diagnostic, MissingError
from factory.support.interruption import put_off


def optional(module: str, package: str, what: str, extra: str, otherwise: str = "") -> Any:
    """A module of an optional package, which `what` needs. Raises MissingError with the command
    that installs it, or how to do without."""
    try:
        with put_off():
            return import_module(module)
    except ImportError as error:
        hint = f"pip install 'klavins-factory[{extra}]'" + (
            f", or {otherwise}" if otherwise else ""
        )
        message = f"{what} needs {package}: {error}"
        raise MissingError(Diagnostic("Missing", message, None, hint)) from error
