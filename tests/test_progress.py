"""The progress bar: shown on a terminal only, and harmless to a run."""

from __future__ import annotations

import io
import sys
from types import SimpleNamespace

import pytest

from factory.support.progress import Progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def watch(progress: Progress) -> None:
    with progress:
        for n in range(4):
            progress.observe(SimpleNamespace(time=float(n), delivered=lambda n=n: n), None)


@pytest.mark.parametrize(("stream", "quiet"), [(io.StringIO(), False), (Terminal(), True)])
def test_it_is_silent_without_a_terminal_or_when_quiet(monkeypatch, stream, quiet: bool) -> None:
    monkeypatch.setattr(sys, "stderr", stream)
    watch(Progress(3, quiet))
    assert stream.getvalue() == ""


def test_it_shows_units_and_speed(monkeypatch) -> None:
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    watch(Progress(3))
    assert "3/3" in stream.getvalue() and "real time" in stream.getvalue()
