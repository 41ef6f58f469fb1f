"""The engine, `mujoco`, imported so that it loads whatever MUJOCO_GL says, with or without GL.

MuJoCo binds a window system when it is imported, which takes time, and fails where MUJOCO_GL names
none or its library is missing. Pictures have contexts of their own (`factory.support.gl`), so it is
bound only where MUJOCO_GL names one, and a failed import is repeated without it. Every module that
needs the engine imports it from here: `from factory.support.engine import mujoco`.
"""

from __future__ import annotations

import os
import re
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from factory.support.environment import environment
from factory.support.errors import Diagnostic, InputError, MissingError
from factory.support.interruption import put_off

with put_off():
    try:
        with environment("MUJOCO_GL", os.environ.get("MUJOCO_GL") or "disable"):
            import mujoco
    except Exception:  # a wrong MUJOCO_GL is a RuntimeError, a missing library anything
        try:
            with environment("MUJOCO_GL", "disable"):
                import mujoco
        except ImportError as error:
            message = f"the engine cannot be loaded: {error}"
            raise MissingError(Diagnostic("Engine", message, None, "pip install mujoco")) from error


def _warn(words: str) -> None:
    """Print a warning to stderr; the engine's own handler writes to stdout and to a file."""
    with suppress(BaseException):  # an exception in here would end the process
        print(f"engine: {words}", file=sys.stderr)


@contextmanager
def unwarned() -> Iterator[None]:
    """A context without warnings of the engine and of its Python binding."""
    mujoco.set_mju_user_warning(lambda words: None)
    try:
        with warnings.catch_warnings(action="ignore"):
            yield
    finally:
        mujoco.set_mju_user_warning(_warn)


@contextmanager
def by_name() -> Iterator[None]:
    """A context in which a name that a model lacks raises InputError (Engine)."""
    try:
        yield
    except KeyError as error:
        name = re.match(r"Invalid name ('.+?')\. Valid", str(error.args[0]))
        if name is None:
            raise
        message, hint = f"the engine's model has no {name[1]}", "build the model anew"
        raise InputError(Diagnostic("Engine", message, None, hint)) from error


mujoco.set_mju_user_warning(_warn)

__all__ = ["mujoco", "unwarned"]
