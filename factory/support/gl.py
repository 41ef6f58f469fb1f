"""OpenGL for rendering without a screen: chosen, tested in a subprocess, diagnosed where missing.

A GL that does not work raises one of four errors, or ends the process; so a subprocess tests it.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from factory.support.errors import Diagnostic, MissingError
from factory.support.interruption import put_off

__all__ = ["probe"]

APT = "apt-get install -y libegl1 libgl1"
"""On Debian, these two packages bring Mesa's EGL and its software renderer."""

VALID = ("egl", "osmesa", "glfw")

_DEFAULT = ("", "enable", "enabled", "on", "true", "1")

_DETOURS = (
    "__EGL_VENDOR_LIBRARY_DIRS",
    "__EGL_VENDOR_LIBRARY_FILENAMES",
    "LIBGL_DRIVERS_PATH",
    "MUJOCO_EGL_DEVICE_ID",
    "PYOPENGL_PLATFORM",
)
"""Variables that change where drivers are looked for."""


def prepare() -> str:
    """Set MUJOCO_GL to `egl` unless it names a backend; gives the name in lower case."""
    named = os.environ.get("MUJOCO_GL", "").lower().strip()
    if named in _DEFAULT:
        os.environ["MUJOCO_GL"] = named = "egl"
    return named


def context(width: int, height: int) -> Any:
    """A current GL context without a window. Call `probe` first; raises anything where GL is
    broken."""
    module = {"egl": "mujoco.egl", "osmesa": "mujoco.osmesa"}.get(prepare(), "mujoco.glfw")
    with put_off():
        made: Any = import_module(module).GLContext
    made_context = made(width, height)
    made_context.make_current()
    return made_context


def probe() -> None:
    """Render a tiny picture in a subprocess, once in this process for the same environment. Raises
    MissingError (NoGL) with the command that helps."""
    prepare()
    fault = _probed(tuple((name, os.environ.get(name)) for name in ("MUJOCO_GL", *_DETOURS)))
    if fault is not None:
        raise MissingError(fault)


@cache
def _probed(variables: tuple[tuple[str, str | None], ...]) -> Diagnostic | None:
    """What is wrong with GL under these variables, None where it works."""
    named = prepare()
    if named not in VALID:
        message = f"rendering needs OpenGL, and MUJOCO_GL={named} is no way to get it"
        return Diagnostic("NoGL", message, None, f"set MUJOCO_GL=egl; valid: {', '.join(VALID)}")
    reason = _reason()
    if not reason:
        return None
    message = (
        f"rendering needs OpenGL through MUJOCO_GL={named}, which does not work here: {reason}"
    )
    return Diagnostic("NoGL", message, None, _way_out(named, dict(variables)))


def _reason() -> str:
    """The last line of output of a process that fails to render a tiny picture; "" if it can."""
    package = str(Path(__file__).resolve().parents[2])
    paths = os.pathsep.join([package, *filter(None, [os.environ.get("PYTHONPATH")])])
    command = [sys.executable, "-c", "from factory.support.gl import trial; trial()"]
    try:
        done = subprocess.run(
            command,
            env={**os.environ, "PYTHONPATH": paths},
            capture_output=True,
            text=True,
            timeout=120,
            stdin=subprocess.DEVNULL,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return str(error)
    if done.returncode == 0:
        return ""
    lines = [line.strip() for line in done.stderr.splitlines() if line.strip()]
    last = lines[-1].partition(". ")[0] if lines else ""
    return last or f"the trial ended with status {done.returncode}"


def _way_out(named: str, variables: dict[str, str | None]) -> str:
    """The command that helps."""
    if named == "glfw":
        return "set MUJOCO_GL=egl, which needs no screen"
    if named == "osmesa":
        return "apt-get install -y libosmesa6, or set MUJOCO_GL=egl"
    detours = [name for name in _DETOURS if variables.get(name)]
    if detours and loads("libEGL.so.1") and loads("libGL.so.1"):
        return f"unset {' '.join(detours)}; or {APT}"
    return APT


def loads(library: str) -> bool:
    """Whether a shared library can be loaded."""
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def trial() -> None:
    """Render a red ball on 64 x 64 pixels, or raise whatever goes wrong."""
    from factory.support.engine import mujoco

    ball = '<geom size="1" rgba="1 0 0 1"/>'
    m = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{ball}</worldbody></mujoco>")
    d = mujoco.MjData(m)
    mujoco.mj_forward(m, d)
    with mujoco.Renderer(m, 64, 64) as renderer:
        renderer.update_scene(d)
        red, green = renderer.render()[32, 32, :2]
    if not red > green:
        raise RuntimeError("the picture stays empty")


def import_mujoco() -> Any:
    """The engine, for rooms that may not import it. Raises MissingError where it cannot be
    loaded."""
    from factory.support.engine import mujoco

    return mujoco
