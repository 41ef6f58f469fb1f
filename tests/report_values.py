"""A report for tests, read back from its page: what is in it, and its arrays as numbers."""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np

from factory.apps.log.blocks import LENGTH, MAGIC

EVIL = """</script></title><img src=x onerror="alert(1)">'"&<!--"""
"""A name that would run a script if it were taken for anything but text."""


class Page(HTMLParser):
    """The elements of a page with their attributes, and the contents of its scripts by id, or by
    number for those without."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: dict[str, str] = {}
        self.words: list[str] = []
        self.script: str | None = None
        self.feed(text)
        self.data: dict[str, Any] = json.loads(self.scripts["data"])
        self.packed = gzip.decompress(base64.b64decode(self.scripts["packed"]))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag == "script":
            self.script = dict(attrs).get("id") or f"{len(self.scripts)}"

    def handle_endtag(self, tag: str) -> None:
        if tag == "script":
            self.script = None

    def handle_data(self, data: str) -> None:
        if self.script is not None:
            self.scripts[self.script] = self.scripts.get(self.script, "") + data
        else:
            self.words.append(data)

    @property
    def code(self) -> list[str]:
        """The scripts that run."""
        return [text for name, text in self.scripts.items() if name.isdigit()]

    @property
    def policy(self) -> str:
        """Its content security policy."""
        return next(str(a["content"]) for tag, a in self.tags if "http-equiv" in a)

    def array(self, name: str) -> np.ndarray:
        """An array of the pack."""
        kind, start, count = self.data["arrays"][name]
        return np.frombuffer(self.packed, f"<{kind}", count, start)

    def track(self, name: str, rows: int) -> np.ndarray:
        """Positions or quaternions of a body (rows, frames), as the page restores them."""
        planes = self.array(name).reshape(4, -1).T
        steps = np.ascontiguousarray(planes).view("<i4").reshape(rows, -1)
        return np.cumsum(steps, axis=1) / self.data["frames"]["units"]

    def marked_at_end(self) -> set[int]:
        """The token game of the page."""
        marked = set(self.data["start"])
        for event in self.data["fired"]:
            marked -= {p for p, after in enumerate(self.data["right"]) if event in after}
            marked |= {p for p, before in enumerate(self.data["left"]) if event in before}
        return marked


def altered(log: Path, to: Path, change: Callable[[dict[str, Any]], object]) -> Path:
    """A log with another header."""
    data = log.read_bytes()[len(MAGIC) :]
    (length,) = LENGTH.unpack_from(data)
    header = json.loads(data[LENGTH.size : LENGTH.size + length])
    change(header)
    text = json.dumps(header).encode()
    to.write_bytes(MAGIC + LENGTH.pack(len(text)) + text + data[LENGTH.size + length :])
    return to
