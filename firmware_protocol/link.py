"""The contract every byte link keeps, and the door through which links are opened."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Self

from firmware_protocol.address import EXAMPLES, parse_address
from firmware_protocol.errors import AddressError
from firmware_protocol.wire.fields import MAVLINK

if TYPE_CHECKING:
    from types import TracebackType


class Link(ABC):
    """Carries bytes to and from a robot; knows nothing of messages.

    A link may be read by one thread and written by another. Third-party errors never pass: they become
    `LinkOpenError`, `LinkClosedError` or `LinkTimeoutError`.

    Attributes:
        url: Address it was opened with.
        lockstep: True when time passes only inside `read` (an in-process link): such a link must be read
            by the thread that uses it, never by a pump thread.
        wire: What the bytes are: `MAVLINK`, or `CAN`, where every read and write is of whole CAN frames.
    """

    url: str
    lockstep: bool = False
    wire: str = MAVLINK

    def news(self) -> list[str]:
        """What has happened to the link since the last call, in words: a bus in trouble, or well again."""
        return []

    @abstractmethod
    def write(self, data: bytes) -> None:
        """Hand over bytes for sending. One call carries whole frames.

        Raises:
            LinkClosedError: The link is gone.
            LinkTimeoutError: The other end does not take the bytes; a part of them may be on its way.
        """

    @abstractmethod
    def read(self, timeout: float) -> bytes:
        """Wait for bytes.

        Args:
            timeout: Longest wait in s; 0 returns at once with what is there.

        Returns:
            What has arrived, as soon as anything has; empty after the time-out.

        Raises:
            LinkClosedError: The link is gone (bytes that arrived before are returned first).
        """

    @abstractmethod
    def close(self) -> None:
        """Give the link back. Repeating it does nothing; later calls of `read` and `write` raise LinkClosedError.

        Another thread must not be inside `read` or `write` meanwhile.
        """

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()


def open_link(url: str) -> Link:
    """Open a link that leads out of this process.

    The options `system` and `node`, which select a robot, are allowed and mean nothing here.

    Args:
        url: `serial://PORT:BAUD`, `tcp://HOST:PORT`, `udpin://HOST:PORT` (waits for the robot to speak first),
            `udpout://HOST:PORT` or `can://INTERFACE/CHANNEL?bitrate=RATE`. `sim://` and `replay://` are the business of
            `hil.connect`.

    Returns:
        The open link; close it after use (it is a context manager).

    Raises:
        LinkOpenError: It could not be opened; the text says what to do.
        AddressError: The URL is not one of these.
    """
    # Imported here: codecs and peer share this package and must not load serial ports and sockets.
    from firmware_protocol.links.serial import SerialLink  # noqa: PLC0415
    from firmware_protocol.links.tcp import TcpLink  # noqa: PLC0415
    from firmware_protocol.links.udp import UdpLink  # noqa: PLC0415

    address = parse_address(url)
    if address.scheme == "can":
        from firmware_protocol.links.can import open_can  # noqa: PLC0415 - python-can is optional

        return open_can(address)
    address.only("system", "node")
    match address.scheme:
        case "serial":
            return SerialLink(url, *address.port_baud())
        case "tcp":
            return TcpLink(url, *address.host_port())
        case "udpin":
            return UdpLink(url, *address.host_port(), listen=True)
        case "udpout":
            return UdpLink(url, *address.host_port(), listen=False)
        case scheme:
            raise AddressError(url, f"no link is called {scheme!r}", f"Write for instance {EXAMPLES}")
