"""Where a served robot can be reached over CAN: a bus, or a serial CAN adapter on a pty."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import AddressError, LinkTimeoutError
from firmware_protocol.links.can import open_can
from firmware_protocol.wire.fields import CAN
from simdevice.serving.endpoints import Endpoint, PtyEndpoint
from simdevice.serving.slcan import SlcanAdapter

if TYPE_CHECKING:
    from firmware_protocol.address import Address

SLCAN_BAUD: Final = 1_000_000
"""Rate between computer and adapter in bit/s, unless another is asked for: a CAN bus's own."""


class CanEndpoint(Endpoint):
    """A node on a CAN bus.

    Args:
        address: As a client opens it; a client on this machine opens the same.
        public: Frames may leave this machine.

    Raises:
        AddressError: It cannot be understood, or other machines could reach it.
        LinkOpenError: The bus cannot be had.
    """

    wire = CAN

    def __init__(self, address: Address, *, public: bool = False) -> None:
        if not public and address.options.get("hop_limit", "0") != "0":
            raise AddressError(address.url, "other machines could reach this address", "Leave hop_limit out, or use --public")
        self._link = open_can(address)
        self.url = address.url
        self._in = b""

    def files(self) -> list[int]:
        """The bus's file, where it has one."""
        file = self._link.fileno()
        return [file] if file >= 0 else []

    def poll(self, now: float) -> None:  # noqa: ARG002 - a bus is not paced
        """Take every frame that has come."""
        while data := self._link.read(0.0):
            self._in += data

    def receive(self, now: float) -> bytes:
        """Frames that have arrived, in serial form."""
        self.poll(now)
        data, self._in = self._in, b""
        return data

    def send(self, data: bytes, now: float) -> None:  # noqa: ARG002 - a bus is not paced
        """Send frames; what a busy bus does not take is lost."""
        if data:
            try:
                self._link.write(data)
            except LinkTimeoutError:
                return

    def close(self) -> None:
        """Leave the bus."""
        self._link.close()


class SlcanEndpoint(Endpoint):
    """A serial CAN adapter on a pseudo-terminal, with the robot alone on its bus. POSIX only.

    Args:
        baud: Between computer and adapter, in bit/s.

    Attributes:
        path: The client's end, such as `/dev/pts/3`.

    Raises:
        LinkOpenError: This system has no ptys.
    """

    wire = CAN

    def __init__(self, baud: int = SLCAN_BAUD) -> None:
        self._pty = PtyEndpoint(baud)
        self._adapter = SlcanAdapter()
        self.path = self._pty.path
        self.url = f"can://slcan/{self.path}?sleep_after_open=0"

    @property
    def is_open(self) -> bool:
        """The client has opened the adapter's channel: frames pass."""
        return self._adapter.is_open

    def files(self) -> list[int]:
        """The pty's file."""
        return self._pty.files()

    def poll(self, now: float) -> None:
        """Take in what the client has written."""
        self._pty.poll(now)

    def receive(self, now: float) -> bytes:
        """Frames that have arrived, in serial form."""
        frames, answers = self._adapter.take(self._pty.receive(now))
        if answers:
            self._pty.send(answers, now)
        return frames

    def send(self, data: bytes, now: float) -> None:
        """Send frames, at the pace of the line."""
        self._pty.send(self._adapter.give(data), now)

    def due(self) -> float:
        """When the bytes under way have passed."""
        return self._pty.due()

    def close(self) -> None:
        """Close the pty."""
        self._pty.close()
