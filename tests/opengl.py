"""Whether this machine can draw, for tests that need it."""

from __future__ import annotations

import pytest

from factory.support import gl
from factory.support.errors import MissingError


def why_no_gl() -> str:
    """Why nothing can be drawn here, "" where it can."""
    try:
        gl.probe()
    except MissingError as error:
        return str(error)
    return ""


WHY = why_no_gl()
needs_gl = pytest.mark.skipif(bool(WHY), reason=f"no headless OpenGL here: {WHY}")
