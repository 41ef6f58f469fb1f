"""Environment variables set for a while."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

__all__: list[str] = []


@contextmanager
def environment(name: str, value: str) -> Iterator[None]:
    """A context in which an environment variable is set; it is restored afterwards."""
    before = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before
