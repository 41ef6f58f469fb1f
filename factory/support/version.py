"""The versions of this package, which is that in pyproject.toml, and of others; and the optional
packages: the extras of this one."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from types import MappingProxyType
from typing import Any

from factory.support.errors import Diagnostic, MissingError
from factory.support.interruption import put_off

__all__ = ["__version__", "optional", "release"]

__version__ = "0.1.0"
"""The version of this package."""

EXTRAS: Mapping[str, tuple[tuple[str, ...], str]] = MappingProxyType(
    {
        "decompose": (("coacd",), "meshes of free form collide as convex pieces"),
        "live": (("websockets",), "`view`, in the browser"),
        "opcua": (("asyncua",), "`plant`, for a PLC"),
        "gym": (("gymnasium",), "`factory.env`, for learning"),
        "export": (("ezdxf", "foxglove-sdk"), "DXF and MCAP"),
        "usd": (("usd-core",), "USD"),
        "yaml": (("pyyaml",), "`import` of trees in YAML"),
        "cluster": (("distributed",), "many runs on a Dask cluster (`--on`)"),
        "step": (("cascadio",), "`plan` of STEP files"),
        "pandas": (("pandas",), "tables as data frames (`to_frame`)"),
    }
)
"""Each extra: its packages, and what it is for."""


def installs(extra: str) -> str:
    """The command that installs an extra."""
    return f"pip install 'klavins-factory[{extra}]'"


def optional(module: str, package: str, what: str, extra: str, otherwise: str = "") -> Any:
    """A module of an optional package.

    Args:
        module: its dotted name.
        package: the name of the package, for the message.
        what: the feature that needs it.
        extra: the extra of this distribution that installs it.
        otherwise: an alternative, instead of the command that installs it.

    Raises MissingError where it is not installed.
    """
    try:
        with put_off():
            return import_module(module)
    except ImportError as error:
        hint = installs(extra) + (f", or {otherwise}" if otherwise else "")
        message = f"{what} needs {package}: {error}"
        raise MissingError(Diagnostic("Missing", message, None, hint)) from error


def release(package: str) -> str:
    """The version of an installed package, "" where it is not installed."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(package)
    except PackageNotFoundError:
        return ""
