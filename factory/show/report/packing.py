"""Arrays of numbers as one text in a page: concatenated, compressed, in base 64."""

from __future__ import annotations

import gzip
import json
from base64 import b64encode
from typing import Any

import numpy as np
from numpy.typing import NDArray


class Pack:
    """A growing buffer. `index`: for each array by name its type, first byte and count."""

    def __init__(self) -> None:
        self.index: dict[str, tuple[str, int, int]] = {}
        self._parts: list[bytes] = []
        self._size = 0

    def add(self, name: str, values: NDArray[Any]) -> None:
        """Add an array, of type f4, u4 or u1, starting at a multiple of four bytes."""
        kind = {"f": "f4", "u": f"u{values.dtype.itemsize}"}[values.dtype.kind]
        content = np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()
        content += bytes(-len(content) % 4)
        self.index[name] = kind, self._size, int(values.size)
        self._parts.append(content)
        self._size += len(content)

    def text(self) -> str:
        """The buffer, compressed with gzip (the same bytes at any time), in base 64."""
        return b64encode(gzip.compress(b"".join(self._parts), 9, mtime=0)).decode()


def planes(values: NDArray[np.int32]) -> NDArray[np.uint8]:
    """Whole numbers as first differences along the last axis, byte plane by byte plane: slow
    changes give zeros, which compress well."""
    steps = np.diff(values.astype(np.int64), axis=-1, prepend=0).astype("<i4")
    return np.ascontiguousarray(steps.reshape(-1).view(np.uint8).reshape(-1, 4).T).reshape(-1)


def json_inside(value: Any) -> str:
    """JSON for a `<script>`: nothing in it ends the script or begins a comment."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")
