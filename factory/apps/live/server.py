"""The server of a session: one page, and one socket for each browser, at a secret address."""

from __future__ import annotations

import json
import logging
from dataclasses import asdict
from http import HTTPStatus
from ipaddress import ip_address
from secrets import token_urlsafe
from threading import Thread
from typing import TYPE_CHECKING, Any

from factory.api import Diagnostic, InputError
from factory.apps.live.commands import command_of
from factory.apps.live.session import LiveEvent, LiveFrame, Session
from factory.support.resource import Closing
from factory.support.version import optional

if TYPE_CHECKING:
    from websockets.http11 import Request, Response
    from websockets.sync.server import ServerConnection

RECENT = 2000
"""Number of past firings that a new watcher is sent."""

PATIENCE = 1.0
"""Longest interval between two messages to a watcher [s]."""

LARGEST = 4096
"""Upper bound on the bytes of a command."""

MOST = 16
"""Upper bound on the watchers at once."""

HEADERS = {
    "Content-Type": "text/html; charset=utf-8",
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


def is_loopback(host: str) -> bool:
    """Whether an address can be reached from this machine only."""
    try:
        return ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host == "localhost"


def check_host(host: str, exposed: bool) -> None:
    """Raises InputError (BadValue) for a host other than loopback unless it is exposed."""
    if not is_loopback(host) and not exposed:
        message = f"'{host}' can be reached from other machines, which could control this factory"
        hint = "add --expose to allow this, or use `ssh -L` and the host 127.0.0.1"
        raise InputError(Diagnostic("BadValue", message, None, hint))


def check_server(host: str, exposed: bool) -> Any:
    """The module that serves sockets. Raises what `check_host` does, MissingError without the
    package `websockets`."""
    check_host(host, exposed)
    return optional("websockets.sync.server", "websockets", "a page in the browser", "live")


class Server(Closing):
    """Listens from when it is made until it is closed; `address` is the page's. `exposed`: other
    machines may connect, by any name of this one.

    The address has a secret in it that is new every time, without which nothing is served; a page
    of another origin is refused. Raises what `check_server` does, and InputError (BadValue) where
    it cannot listen.
    """

    def __init__(
        self,
        session: Session,
        page: bytes,
        host: str = "127.0.0.1",
        port: int = 0,
        exposed: bool = False,
    ) -> None:
        serving = check_server(host, exposed)
        self._session, self._page, self._exposed = session, page, exposed
        self._secret = token_urlsafe(16)
        self._watchers = 0
        try:
            self._server = serving.serve(
                self._watch,
                host,
                port,
                process_request=self._answer,
                max_size=LARGEST,
                logger=_silent(),
                server_header=None,
            )
        except OSError as error:
            message = f"cannot listen on {host}, port {port}: {error.strerror or error}"
            hint = "another port: --port 0 takes a free one"
            raise InputError(Diagnostic("BadValue", message, None, hint)) from error
        self.port = int(self._server.socket.getsockname()[1])
        shown = f"[{host}]" if ":" in host else host
        self.address = f"http://{shown}:{self.port}/{self._secret}/"
        self._thread = Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Disconnect all watchers."""
        self._server.shutdown()
        self._thread.join()

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """The response to a request; None for one that becomes a socket."""
        host = request.headers.get("Host", "")
        name = host.rpartition(":")[0] if not host.endswith("]") and ":" in host else host
        if not self._exposed and not is_loopback(name):
            return connection.respond(HTTPStatus.FORBIDDEN, "unknown host name\n")
        if request.path == f"/{self._secret}/live":
            if request.headers.get("Origin") not in (f"http://{host}", None):
                return connection.respond(HTTPStatus.FORBIDDEN, "wrong origin\n")
            if self._watchers >= MOST:
                return connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, "too many watchers\n")
            return None
        if request.path != f"/{self._secret}/":
            return connection.respond(HTTPStatus.NOT_FOUND, "not found\n")
        from websockets.datastructures import Headers
        from websockets.http11 import Response

        size = str(len(self._page))
        headers = Headers({**HEADERS, "Content-Length": size, "Connection": "close"})
        return Response(HTTPStatus.OK, "OK", headers, self._page)

    def _watch(self, connection: ServerConnection) -> None:
        """Send the newest frame, and all firings, until the connection is closed."""
        from websockets.exceptions import ConnectionClosed

        hearing = Thread(target=self._hear, args=(connection,), daemon=True)
        self._watchers += 1
        try:
            hearing.start()
            number, run, events, failures = 0, -1, 0, 0
            while True:
                frame = self._session.wait(number, PATIENCE)
                if frame.run != run:
                    run, events, failures = frame.run, max(0, frame.count - RECENT), 0
                fired = self._session.fired(run, events, frame.count)
                failed = self._session.failed(run, failures, frame.failed)
                in_order = sorted([*failed, *fired], key=lambda event: event[0])
                connection.send(packed(frame, in_order))
                number, events, failures = frame.number, frame.count, frame.failed
        except ConnectionClosed:
            pass
        finally:
            self._watchers -= 1

    def _hear(self, connection: ServerConnection) -> None:
        """Pass commands on to the session; an invalid one is answered with its error."""
        from websockets.exceptions import ConnectionClosed

        factory = self._session.simulation.layout.factory
        robots, parts = len(factory.robots), {o.label for o in factory.leaves}
        try:
            for message in connection:
                try:
                    command = command_of(message, robots, parts, self._session.fails)
                except ValueError as error:
                    connection.send(json.dumps({"error": str(error)}))
                else:
                    self._session.send(command)
        except ConnectionClosed:
            pass


def _silent() -> logging.Logger:
    """A logger without output: failed connections are normal."""
    logger = logging.Logger("factory.live")
    logger.addHandler(logging.NullHandler())
    return logger


def packed(frame: LiveFrame, fired: list[LiveEvent]) -> bytes:
    """A frame in the format of the page: the length of a JSON text (4 bytes, little-endian), the
    text, padded to a multiple of 4, and the poses."""
    document = {**asdict(frame), "outages": frame.outages.as_json(), "fired": fired}
    del document["number"], document["poses"]
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    return len(text).to_bytes(4, "little") + text + frame.poses
