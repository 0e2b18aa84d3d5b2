"""A link over UDP: waiting for a robot to speak first (`udpin`), or speaking to a known one (`udpout`).

UDP knows no connection: a robot that is not there yet, or not any more, is silence and never `LinkClosedError`.
"""

from __future__ import annotations

import contextlib
import select
import socket
from typing import Any, Final

from firmware_protocol.errors import LinkClosedError, LinkOpenError
from firmware_protocol.link import Link

_LARGEST: Final = 65535
"""Longest datagram, in bytes."""


class UdpLink(Link):
    """An open UDP socket.

    Args:
        url: Name of the link in messages and logs.
        host: Address to listen on, or the robot's.
        port: Its port.
        listen: Wait for the robot to speak first, and answer whoever spoke last; until then writes go nowhere.

    Raises:
        LinkOpenError: The port is taken, or the name is not known.
    """

    def __init__(self, url: str, host: str, port: int, *, listen: bool) -> None:
        self.url = url
        self._robot: Any = None
        self._closed = False
        try:
            family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
            self._socket = socket.socket(family, kind, protocol)
        except (OSError, UnicodeError) as error:
            raise LinkOpenError(url, f"there is no address {host}: {error}") from error
        try:
            self._socket.settimeout(0)
            if listen:
                self._socket.bind(address)
            else:
                self._socket.connect(address)
                self._robot = address
        except OSError as error:
            self._socket.close()
            remedy = "Another program may have it: close that program or choose another port" if listen else ""
            raise LinkOpenError(url, f"cannot use {host}:{port} ({error.strerror})", remedy) from error
        self._listen = listen

    @property
    def local_port(self) -> int:
        """Port this end uses."""
        return int(self._socket.getsockname()[1])

    def write(self, data: bytes) -> None:
        """Send one datagram."""
        if self._closed:
            raise LinkClosedError(self.url, "the link is closed")
        if self._robot is None:
            return
        # A full buffer, or a robot that is not there, loses the datagram: as the network may at any time.
        try:
            with contextlib.suppress(BlockingIOError, ConnectionError):
                if self._listen:
                    self._socket.sendto(data, self._robot)
                else:
                    self._socket.send(data)
        except OSError as error:
            raise LinkClosedError(self.url, f"the network is gone ({error.strerror})") from error

    def read(self, timeout: float) -> bytes:
        """Wait for a datagram, at most `timeout` s."""
        if self._closed:
            raise LinkClosedError(self.url, "the link is closed")
        try:
            if not select.select([self._socket], [], [], max(0.0, timeout))[0]:
                return b""
            data, sender = self._socket.recvfrom(_LARGEST)
        except (BlockingIOError, ConnectionError):  # "nobody there", the answer to an earlier datagram
            return b""
        except OSError as error:
            raise LinkClosedError(self.url, f"the network is gone ({error.strerror})") from error
        if self._listen:
            self._robot = sender
        return data

    def close(self) -> None:
        """Close the socket."""
        if not self._closed:
            self._closed = True
            self._socket.close()
