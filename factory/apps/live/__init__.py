"""A running factory in the browser, with commands to pause, push, slow down, kill and block."""

from factory.apps.live.server import Server
from factory.apps.live.session import LiveFrame, Session

__all__ = ["LiveFrame", "Server", "Session"]
