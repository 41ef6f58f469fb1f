"""What apps give to the core, which knows none of them.

An app of this package is a folder `factory/apps/NAME`; its module `app`, where it has one, defines
`APP`. An app of another package is an `App` that an entry point of the group `factory.apps` names.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any

from factory.support.errors import Diagnostic, MissingError
from factory.support.extensions import bad_extension, extensions, position_of

FOLDER = Path(__file__).resolve().parents[1] / "apps"


@dataclass(frozen=True, slots=True)
class App:
    """What an app gives.

    Attributes:
        name: of the app, unique.
        layouts: by the name of a variant of a layout, the function that makes it, as
            `package.module:function`; it takes a layout, the ground that asks for the variant, the
            settings and the hands to choose from, and gives a layout with its certificate.
    """

    name: str
    layouts: Mapping[str, str] = field(default_factory=dict)


@cache
def apps() -> Mapping[str, App]:
    """All apps by name: those of this package, then those of others. Raises InputError
    (BadExtension) where an entry point names no app, or one of a name that is there."""
    files = sorted(FOLDER.glob("*/app.py"))
    modules = (import_module(f"factory.apps.{file.parent.name}.app") for file in files)
    found_here = {module.APP.name: module.APP for module in modules}
    for name, app in extensions("apps").items():
        if not isinstance(app, App) or app.name in found_here:
            message = f"the entry point '{name}' of factory.apps is no App with a name of its own"
            raise bad_extension(message, position_of(app))
        found_here[app.name] = app
    return MappingProxyType(found_here)


def layout_variant(name: str) -> Callable[..., Any]:
    """The function of an app that makes a variant of a layout. Raises MissingError where no app has
    one of this name."""
    for app in apps().values():
        if name in app.layouts:
            module, _, function = app.layouts[name].partition(":")
            made: Callable[..., Any] = getattr(import_module(module), function)
            return made
    there = sorted(variant for app in apps().values() for variant in app.layouts)
    message = f"no app lays out a '{name}'"
    hint = f"variants that apps give: {', '.join(there) or 'none'}"
    raise MissingError(Diagnostic("Missing", message, None, hint))
