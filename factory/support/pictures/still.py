"""Stills: pictures as files."""

from __future__ import annotations

from pathlib import Path

import imageio.v3 as iio

from factory.support.files import unwritten, write_bytes
from factory.support.pictures.ink import Pixels

__all__ = ["write_still"]


def write_still(path: Path, pixels: Pixels) -> None:
    """A picture (height, width, 3) as PNG. Raises InputError where it cannot be written."""
    content = iio.imwrite("<bytes>", pixels, extension=".png", plugin="pillow")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(path, content)
    except OSError as error:
        raise unwritten(path, error) from error
