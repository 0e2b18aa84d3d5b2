"""Serves the page of a run to browsers, and takes what is asked for there: a closed list.

Who knows the token in the address may look on; it is 128 random bits, and stands in no log and on no command line. A page of
somebody else's, open in the same browser, is kept out by it, and by the names that a request gives: those of the host and of
the page that it comes from have to be ours.
"""

from __future__ import annotations

import json
import secrets
import socket
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import BoundedSemaphore, Thread
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from hil.look.live.broadcast import Broadcast

MOST_STREAMS: Final = 4
"""Pages that look on at a time. A browser has six connections to a server, over all its pages: with six streams open it would
never send the stop."""
PATIENCE: Final = 20.0
"""Who neither sends nor takes anything for so long, in s, is cut off."""
LARGEST_REQUEST: Final = 1_000
"""Bytes that may come with what is asked for."""
LOOPBACK: Final = "127.0.0.1"
FULL: Final = "full"
"""Kind of the event that says that there is no room for one more."""


class LiveServer:
    """Serves a page, in threads of its own, until the process ends.

    Args:
        page: The page, HTML in UTF-8.
        broadcast: What is told to it.
        inputs: What may be asked for on the page, by name: what does it, and says what came of it, such as JSON can hold.
        public: Others on the network may look on, not only who uses this machine.
        token: What the address holds; None draws it.

    Attributes:
        token: As given, or drawn.
        url: Address of the page.

    Raises:
        OSError: No port can be listened on.
    """

    def __init__(
        self,
        page: bytes,
        broadcast: Broadcast,
        inputs: Mapping[str, Callable[[], dict[str, Any]]],
        *,
        public: bool = False,
        token: str | None = None,
    ) -> None:
        self.page = page
        self.broadcast = broadcast
        self.inputs = inputs
        self.token = token or secrets.token_urlsafe(16)
        self.room = BoundedSemaphore(MOST_STREAMS)
        self._http = _Threads(self, "" if public else LOOPBACK)
        port = self._http.server_address[1]
        named = own_address() if public else LOOPBACK
        self.hosts = frozenset(f"{name}:{port}" for name in (named, LOOPBACK, "localhost"))
        self.origins = frozenset(f"http://{host}" for host in self.hosts)
        self.url = f"http://{named}:{port}/{self.token}/"
        Thread(target=self._http.serve_forever, name="live page", daemon=True).start()

    def close(self) -> None:
        """Listen no more."""
        self._http.shutdown()
        self._http.server_close()


class _Threads(ThreadingHTTPServer):
    """Listens, and has each connection served by a thread.

    Args:
        live: What is served.
        host: Where to listen; empty: everywhere.
    """

    daemon_threads = True
    block_on_close = False

    def __init__(self, live: LiveServer, host: str) -> None:
        self.live = live
        super().__init__((host, 0), _Request)

    def handle_error(self, request: Any, client_address: Any) -> None:  # noqa: ANN401 - as its base has it
        """Somebody has gone in the middle: nobody need be told."""


def own_address() -> str:
    """This machine's address on its network; the loopback's where it is on none."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # of a network for examples: nothing is sent, but a way out is chosen
            return str(probe.getsockname()[0])
        except OSError:
            return LOOPBACK


class _Request(BaseHTTPRequestHandler):
    """What one connection asks for."""

    server: _Threads
    protocol_version = "HTTP/1.1"
    timeout = PATIENCE
    server_version = "hil"
    sys_version = ""

    def log_message(self, *_: object) -> None:  # the address has the token in it
        """Say nothing."""

    def do_GET(self) -> None:
        """The page, or what is told to it."""
        what = self._asked()
        if what == "":
            self._give(HTTPStatus.OK, "text/html; charset=utf-8", self.server.live.page)
        elif what == "told":
            self._tell()
        elif what is not None:
            self._refuse(HTTPStatus.NOT_FOUND)

    def do_POST(self) -> None:
        """Something is asked for."""
        what = self._asked()
        if what is None:
            return
        act = self.server.live.inputs.get(what)
        if act is None:
            self._refuse(HTTPStatus.NOT_FOUND)
        elif self.headers.get("Origin") not in self.server.live.origins:
            self._refuse(HTTPStatus.FORBIDDEN)
        else:
            size = self.headers.get("Content-Length", "0")
            if not size.isdecimal() or int(size) > LARGEST_REQUEST:
                self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
                return
            self.rfile.read(int(size))
            self._give(HTTPStatus.OK, "application/json", json.dumps(act()).encode())

    def _asked(self) -> str | None:
        """What of the page is asked for; None, and the refusal is sent, where that may not be."""
        origin = self.headers.get("Origin")
        if self.headers.get("Host") not in self.server.live.hosts:
            self._refuse(HTTPStatus.MISDIRECTED_REQUEST)
        elif origin is not None and origin not in self.server.live.origins:
            self._refuse(HTTPStatus.FORBIDDEN)
        else:
            _, _, rest = self.path.partition("/")
            token, slash, what = rest.partition("/")
            if secrets.compare_digest(token.encode(), self.server.live.token.encode()) and slash:
                return what
            self._refuse(HTTPStatus.NOT_FOUND)
        return None

    def _tell(self) -> None:
        """Say what happens, until it is over or nobody listens."""
        self.close_connection = True
        self._head(HTTPStatus.OK, "text/event-stream")
        if not self.server.live.room.acquire(blocking=False):
            self.wfile.write(f"event: {FULL}\ndata: {MOST_STREAMS}\n\n".encode())
            return
        try:
            for kind, text in self.server.live.broadcast.listen():
                self.wfile.write(f"event: {kind}\ndata: {text}\n\n".encode() if kind else b":\n\n")
        except OSError:
            pass
        finally:
            self.server.live.room.release()

    def _refuse(self, status: HTTPStatus) -> None:
        self.close_connection = True
        self._give(status, "text/plain", status.phrase.encode())

    def _give(self, status: HTTPStatus, kind: str, content: bytes) -> None:
        self._head(status, kind, len(content))
        self.wfile.write(content)

    def _head(self, status: HTTPStatus, kind: str, size: int | None = None) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Cache-Control", "no-store")
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Content-Security-Policy", "frame-ancestors 'none'")
        self.send_header("Cross-Origin-Resource-Policy", "same-origin")
        if size is not None:
            self.send_header("Content-Length", str(size))
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
