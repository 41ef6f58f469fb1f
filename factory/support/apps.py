"""What apps give to the core, which knows none of them.

An app of this package is a folder `factory/apps/NAME`; its module `app`, where it has one, defines
`APP`. An app of another package is an `App` that an entry point of the group `factory.apps` names.
What an app gives is named by places, `package.module:name`, so that only what is used is loaded.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any

from factory.support.errors import Diagnostic, MissingError
from factory.support.extensions import bad_extension, blaming, extensions, position_of

FOLDER = Path(__file__).resolve().parents[1] / "apps"

BESIDE = ("app", "command_line")
"""What stands in the folder of an app beside what it does, which needs none of it to be loaded."""


@dataclass(frozen=True, slots=True)
class App:
    """What an app gives.

    Attributes:
        name: of the app, unique.
        layouts: by the name of a variant of a layout, the place of the function that makes it; it
            takes a layout, the ground that asks for the variant, the settings and the hands to
            choose from, and gives a layout with its certificate.
        commands: by the word after `factory`, the place of a `click.Command`, whose return value
            is the exit status.
    """

    name: str
    layouts: Mapping[str, str] = field(default_factory=dict)
    commands: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for table in (self.layouts, self.commands):
            for name, place in dict(table).items():
                if not isinstance(name, str) or not isinstance(place, str) or ":" not in place:
                    raise TypeError(f"{name!r}: {place!r} is no place 'package.module:name'")


@cache
def shipped() -> Mapping[str, App]:
    """The apps of this package by name."""
    names = sorted(file.parent.name for file in FOLDER.glob("*/app.py"))
    found_here = [_module(f"factory.apps.{name}.app").APP for name in names]
    return MappingProxyType({app.name: app for app in found_here})


@cache
def apps() -> Mapping[str, App]:
    """All apps by name: those of this package, then those of others. Raises InputError
    (BadExtension) where an entry point names no app, or one of a name that is there."""
    every = dict(shipped())
    for name, app in extensions("apps").items():
        if not isinstance(app, App) or app.name in every:
            message = f"the entry point '{name}' of factory.apps is no App with a name of its own"
            raise bad_extension(message, position_of(app))
        every[app.name] = app
    return MappingProxyType(every)


def at(place: str) -> Any:
    """What stands at a place of an app. Raises InputError (BadExtension) for one in another package
    where nothing is."""
    module, _, name = place.partition(":")
    if module.startswith("factory."):
        return getattr(_module(module), name)
    with blaming(f"'{place}' of an app"):
        return getattr(import_module(module), name)


def _module(name: str) -> ModuleType:
    """A module; what an app of this package gives, and its command line, without the package of the
    app, whose names bring most of it along."""
    path = name.split(".")
    if name in sys.modules or path[1] != "apps" or path[3] not in BESIDE:
        return import_module(name)
    spec = spec_from_file_location(name, FOLDER.joinpath(*path[2:]).with_suffix(".py"))
    assert spec and spec.loader, name
    module = sys.modules[name] = module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def layout_variant(name: str) -> Callable[..., Any]:
    """The function of an app that makes a variant of a layout. Raises MissingError where no app has
    one of this name."""
    for app in apps().values():
        if name in app.layouts:
            made: Callable[..., Any] = at(app.layouts[name])
            return made
    there = sorted(variant for app in apps().values() for variant in app.layouts)
    message = f"no app lays out a '{name}'"
    hint = f"variants that apps give: {', '.join(there) or 'none'}"
    raise MissingError(Diagnostic("Missing", message, None, hint))
