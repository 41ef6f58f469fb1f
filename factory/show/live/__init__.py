"""A running factory in the browser: watched, paused, pushed, slowed down and blocked."""

from factory.show.live.server import Server
from factory.show.live.session import Frame, Session

__all__ = ["Frame", "Server", "Session"]
