"""A running factory in the browser: watched, paused, pushed, slowed down and blocked."""

from factory.show.live.server import Server
from factory.show.live.session import LiveFrame, Session

__all__ = ["LiveFrame", "Server", "Session"]
