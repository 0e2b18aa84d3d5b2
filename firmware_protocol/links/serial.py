"""A link over a serial port or a pseudo-terminal.

pyserial opens and configures the port on every system. On POSIX the bytes then go through the file descriptor itself:
pyserial's `read(n)` waits for n bytes, and asking for the number waiting first costs two more system calls.
"""

from __future__ import annotations

import errno
import os
import select
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import serial
import serial.tools.list_ports

from firmware_protocol.errors import LinkClosedError, LinkOpenError, LinkTimeoutError
from firmware_protocol.link import Link
from firmware_protocol.links.access import access_remedy, busy_remedy, holders

WRITE_TIMEOUT: Final = 0.5
"""How long the other end may take to accept bytes, in s."""
_CHUNK: Final = 4096
_AGAIN: Final = (errno.EAGAIN, errno.EWOULDBLOCK, errno.EINTR)


@dataclass(frozen=True)
class SerialPort:
    """A serial port of this machine.

    Attributes:
        device: What to open, as `/dev/ttyACM0` or `COM3`.
        description: Its hardware in words; empty where the system does not say.
        serial_number: Serial number of the USB device, which stays when the port's name changes; empty for none.
        vendor: USB vendor id; None where it is no USB device.
        product: USB product id, likewise.
        maker: Who made it, as it says; empty where it does not.
        model: What it calls itself; empty where it does not.
    """

    device: str
    description: str
    serial_number: str
    vendor: int | None = None
    product: int | None = None
    maker: str = ""
    model: str = ""

    @property
    def words(self) -> str:
        """What it is, to a person who looks for it."""
        kind = f"{self.vendor or 0:04x}:{self.product or 0:04x}"
        return f"the USB device {kind}" + (f" with serial number {self.serial_number}" if self.serial_number else "")

    def same_hardware(self, other: SerialPort) -> bool:
        """Whether this may be the same piece of hardware, whatever its name: for certain only if it has a serial number."""
        same = (self.vendor, self.product, self.serial_number) == (other.vendor, other.product, other.serial_number)
        return same and self.vendor is not None


def list_ports() -> list[SerialPort]:
    """The serial ports of this machine, by name."""
    found = []
    for port in serial.tools.list_ports.comports():
        description = "" if port.description in {None, "n/a"} else str(port.description)
        found.append(
            SerialPort(
                device=str(port.device),
                description=description,
                serial_number=port.serial_number or "",
                vendor=port.vid,
                product=port.pid,
                maker=port.manufacturer or "",
                model=port.product or "",
            )
        )
    return sorted(found, key=lambda port: port.device)


def _open_error(url: str, port: str, error: OSError) -> LinkOpenError:
    """Say in words why a port could not be opened, and what to do."""
    code = error.errno
    if isinstance(error.__context__, OSError) and code is None:
        code = error.__context__.errno
    text = str(error)
    windows_busy = "PermissionError" in text  # Windows answers "access denied" for a port that is in use
    if code in (errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK) or windows_busy:
        having = holders(port)
        return LinkOpenError(
            url, f"{port} is in use by {having[0] if having else 'another program'}", busy_remedy(port, having)
        )
    if code in (errno.EACCES, errno.EPERM):
        return LinkOpenError(url, f"you are not allowed to open {port}", access_remedy(port))
    if code in (errno.ENOENT, errno.ENODEV, errno.ENXIO) or "FileNotFoundError" in text:
        present = [port.device for port in list_ports()]
        remedy = (
            f"Present are: {', '.join(present)}" if present else "This machine has no serial port: is the robot plugged in?"
        )
        return LinkOpenError(url, f"there is no port {port}", remedy)
    if code in (errno.ENOTTY, errno.EISDIR, errno.EINVAL):
        return LinkOpenError(url, f"{port} is not a serial port", "`hil ports` lists those present")
    return LinkOpenError(url, f"{port} could not be opened: {text}")


class SerialLink(Link):
    """An open serial port, ours alone.

    Args:
        url: Name of the link in messages and logs.
        port: Device, as `/dev/ttyACM0` or `COM3`.
        baud: Rate in bit/s (a pseudo-terminal ignores it).

    Raises:
        LinkOpenError: No such port, in use, not allowed, or not a serial port.
    """

    def __init__(self, url: str, port: str, baud: int) -> None:
        self.url = url
        if os.name == "posix" and not Path(port).is_char_device() and Path(port).exists():
            raise LinkOpenError(url, f"{port} is not a serial port", "`hil ports` lists those present")
        try:
            self._port = serial.Serial(port, baud, timeout=0, write_timeout=WRITE_TIMEOUT, exclusive=True)
        except (OSError, ValueError) as error:
            if isinstance(error, OSError):
                raise _open_error(url, port, error) from error
            raise LinkOpenError(url, f"{port} does not take {baud} baud") from error
        self._fd = self._port.fileno() if sys.platform != "win32" else -1
        self._closed = False

    def write(self, data: bytes) -> None:
        """Hand bytes to the port."""
        if self._closed:
            raise LinkClosedError(self.url, "the link is closed")
        if sys.platform == "win32":
            self._write_portable(data)
            return
        rest = data
        while True:
            try:
                rest = rest[os.write(self._fd, rest) :]
            except OSError as error:
                if error.errno not in _AGAIN:
                    raise LinkClosedError(self.url, f"the port is gone ({error.strerror})") from error
            if not rest:
                return
            if not select.select([], [self._fd], [], WRITE_TIMEOUT)[1]:
                raise LinkTimeoutError(self.url, f"the other end took no bytes for {WRITE_TIMEOUT:g} s")

    def read(self, timeout: float) -> bytes:
        """Wait for bytes, at most `timeout` s."""
        if self._closed:
            raise LinkClosedError(self.url, "the link is closed")
        if sys.platform == "win32":
            return self._read_portable(timeout)
        try:
            if not select.select([self._fd], [], [], max(0.0, timeout))[0]:
                return b""
            data = os.read(self._fd, _CHUNK)
        except OSError as error:
            if error.errno in _AGAIN:
                return b""
            raise LinkClosedError(self.url, f"the port is gone ({error.strerror})") from error
        if not data:  # ready, yet nothing to read: the device was unplugged
            raise LinkClosedError(self.url, "the port is gone (unplugged?)")
        return data

    def set_baud(self, baud: int) -> None:
        """Listen at another rate from now on, without closing the port (which makes many boards restart).

        Args:
            baud: In bit/s.

        Raises:
            LinkClosedError: The port is gone.
            LinkOpenError: It can't do this rate.
        """
        if self._closed:
            raise LinkClosedError(self.url, "the link is closed")
        try:
            self._port.baudrate = baud
        except ValueError as error:
            raise LinkOpenError(self.url, f"{self._port.port} does not take {baud} baud") from error
        except OSError as error:
            raise LinkClosedError(self.url, f"the port is gone ({error})") from error

    def close(self) -> None:
        """Close the port."""
        if not self._closed:
            self._closed = True
            self._port.close()

    def _write_portable(self, data: bytes) -> None:
        """Write through pyserial."""
        try:
            self._port.write(data)
        except serial.SerialTimeoutException as error:
            raise LinkTimeoutError(self.url, f"the other end took no bytes for {WRITE_TIMEOUT:g} s") from error
        except OSError as error:
            raise LinkClosedError(self.url, f"the port is gone ({error})") from error

    def _read_portable(self, timeout: float) -> bytes:
        """Read through pyserial: wait for one byte, then take what there is."""
        try:
            if self._port.timeout != timeout:
                self._port.timeout = timeout
            first: bytes = self._port.read(1)
            waiting = self._port.in_waiting if first else 0
            return first + self._port.read(waiting) if waiting else first
        except OSError as error:
            raise LinkClosedError(self.url, f"the port is gone ({error})") from error
