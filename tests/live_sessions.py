"""Sessions of a running factory, for tests of the live page."""

from __future__ import annotations

from threading import Thread
from typing import Any

import pytest

from factory.apps.deviations import Campaign
from factory.apps.live import LiveFrame, Session
from factory.engine.record.state import State
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from tests.layout_values import paper_layout
from tests.waiting import until


class Stopped(Exception):
    """Ends a session."""


def a_session(playing: bool, campaign: Campaign | None = None) -> Session:
    """A session of the paper's example without end; it does not run yet."""
    request = RunRequest(units=10**9, recovers=campaign is not None)
    layout = paper_layout()
    return Session(lambda: Simulation(layout, request), playing, campaign)


class Running:
    """A session that runs in a thread of its own."""

    def __init__(self, playing: bool = True, campaign: Campaign | None = None) -> None:
        self.session = a_session(playing, campaign)
        self.over = False
        self.thread = Thread(target=self._run, daemon=True)
        self.thread.start()

    def _run(self) -> None:
        with pytest.raises(Stopped):
            self.session.run(self._observe)

    def _observe(self, _: State) -> None:
        if self.over:
            raise Stopped

    def until(self, holds: Any) -> LiveFrame:
        """The first frame of which something holds."""
        return until(lambda: frame if holds(frame := self.session.frame) else None)

    def close(self) -> None:
        self.over = True
        self.thread.join(10)
        assert not self.thread.is_alive()
