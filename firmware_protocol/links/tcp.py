"""A link over TCP, as client."""

from __future__ import annotations

import contextlib
import select
import socket
from typing import Final

from firmware_protocol.errors import LinkClosedError, LinkOpenError, LinkTimeoutError
from firmware_protocol.link import Link

OPEN_TIMEOUT: Final = 5.0
"""How long the other end may take to accept the connection, in s."""
WRITE_TIMEOUT: Final = 0.5
"""How long the other end may take to accept bytes, in s."""

SILENT_TIMEOUT: Final = 5.0
"""The connection is gone when the other machine has not acknowledged what was sent for this long, in s."""


HALF_OPEN: Final = 10.0
"""A server takes a client for gone when its machine has answered nothing for this long, in s."""
_PROBES: Final = 5
"""Unanswered questions whether the other machine is there before the connection is taken for gone."""


def notice_half_open(connection: socket.socket, after: float = HALF_OPEN) -> None:
    """Have the system end a connection whose other end has vanished without a word: unplugged, crashed, out of reach.

    Where something was sent, nothing has acknowledged it (TCP_USER_TIMEOUT, Linux only; other systems repeat for minutes);
    where nothing is, the system asks (keep-alive; what of it an old system cannot set stays as that has it, mostly 2 hours).

    Args:
        connection: A connected TCP socket.
        after: Silence of the other machine, in s.
    """
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    idle = max(1, round(after / 2))
    options = {
        "TCP_KEEPIDLE": idle,
        "TCP_KEEPALIVE": idle,  # what macOS calls it
        "TCP_KEEPINTVL": max(1, round(after / 2 / _PROBES)),
        "TCP_KEEPCNT": _PROBES,
        "TCP_USER_TIMEOUT": round(after * 1000),  # in ms
    }
    for name, value in options.items():
        if hasattr(socket, name):
            with contextlib.suppress(OSError):
                connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)


class TcpLink(Link):
    """An open TCP connection.

    Args:
        url: Name of the link in messages and logs.
        host: Name or number of the machine.
        port: Its port.

    Raises:
        LinkOpenError: Nobody listens there, or the name is not known.
    """

    def __init__(self, url: str, host: str, port: int) -> None:
        self.url = url
        try:
            self._socket = socket.create_connection((host, port), OPEN_TIMEOUT)
        except ConnectionRefusedError as error:
            raise LinkOpenError(url, f"nothing listens on port {port} of {host}", "Is the robot's server running?") from error
        except TimeoutError as error:
            raise LinkOpenError(url, f"{host} does not answer", "Is the machine on and reachable?") from error
        except (OSError, UnicodeError) as error:
            raise LinkOpenError(url, f"cannot connect to {host}: {error}") from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        notice_half_open(self._socket, SILENT_TIMEOUT)
        self._socket.settimeout(WRITE_TIMEOUT)
        self._closed = False

    def write(self, data: bytes) -> None:
        """Hand bytes to the connection."""
        if self._closed:
            raise LinkClosedError(self.url, "the link is closed")
        try:
            self._socket.sendall(data)
        except TimeoutError as error:
            raise LinkTimeoutError(self.url, f"the other end took no bytes for {WRITE_TIMEOUT:g} s") from error
        except OSError as error:
            raise LinkClosedError(self.url, f"the connection is gone ({error.strerror})") from error

    def read(self, timeout: float) -> bytes:
        """Wait for bytes, at most `timeout` s."""
        if self._closed:
            raise LinkClosedError(self.url, "the link is closed")
        try:
            if not select.select([self._socket], [], [], max(0.0, timeout))[0]:
                return b""
            data = self._socket.recv(65536)
        except OSError as error:
            raise LinkClosedError(self.url, f"the connection is gone ({error.strerror})") from error
        if not data:
            raise LinkClosedError(self.url, "the other end closed the connection")
        return data

    def close(self) -> None:
        """End the connection."""
        if not self._closed:
            self._closed = True
            self._socket.close()
