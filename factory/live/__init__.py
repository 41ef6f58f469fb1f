"""A running factory in the browser: watched, paused, pushed, slowed down and blocked."""

from factory.live.server import Server
from factory.live.session import Frame, Session

__all__ = ["Frame", "Server", "Session"]
