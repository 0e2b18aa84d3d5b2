"""Opens an address again and again, though what is plugged in may have been given another name meanwhile.

A serial port of USB is known by the serial number, vendor and product of its hardware. Its name changes when it is plugged
in again while a program still holds the old one, or in another order.

The number of a pseudo-terminal that was closed is given to whoever opens the next one, perhaps a person's shell: such a port is
never opened again by its number, only through a symbolic link that has been made anew.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from firmware_protocol.address import parse_address
from firmware_protocol.errors import LinkOpenError
from firmware_protocol.links.opening import open_link
from firmware_protocol.links.serial import SerialPort, list_ports

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from firmware_protocol.address import Address
    from firmware_protocol.link import Link

_SLCAN: Final = "slcan/"
_PSEUDO: Final = "/dev/pts/"


class LinkOpener:
    """Opens one address, again and again.

    Args:
        url: As for `open_link`.
        ports: Lists the serial ports of this machine.

    Raises:
        AddressError: It is no address.
    """

    def __init__(self, url: str, ports: Callable[[], Sequence[SerialPort]] = list_ports) -> None:
        address = parse_address(url)
        self._url = address.url
        self._ports = ports
        self._device = _device(address)
        self._hardware: SerialPort | None = None
        self._tried = 0
        self._leads: tuple[int, ...] | None = None
        self._pseudo = False

    def open(self) -> Link:
        """Open the link; hardware that was opened once is found again under whatever name it has now.

        Where several look the same, each call takes the next.

        Raises:
            LinkOpenError: It can't be opened.
        """
        if self._hardware is not None:
            return self._open_again(self._hardware)
        if self._pseudo and (self._leads is None or self._leads == _made(self._device)):
            reason = f"{self._device} was a pseudo-terminal, whose number may be another program's by now"
            raise LinkOpenError(self._url, reason, "It is found again through a symbolic link that leads to the new one")
        link = open_link(self._url)
        if self._device:
            self._leads = _made(self._device)
            self._pseudo = str(Path(self._device).resolve()).startswith(_PSEUDO)
            names = self._own_names()
            self._hardware = next((port for port in self._ports() if port.device in names and port.vendor is not None), None)
        return link

    def _open_again(self, hardware: SerialPort) -> Link:
        names = [port.device for port in self._ports() if port.same_hardware(hardware)]
        if not names:
            raise LinkOpenError(self._url, f"{hardware.words} is not plugged in")
        own = self._own_names()
        names.sort(key=lambda name: name not in own)  # the name it had comes first
        name = names[self._tried % len(names)]
        self._tried += 1
        return open_link(self._url if name in own else self._url.replace(self._device, name, 1))

    def _own_names(self) -> set[str]:
        """The name in the address, and the port's own where that is a link to it."""
        return {self._device, str(Path(self._device).resolve())}


def _device(address: Address) -> str:
    """The serial port of an address; empty where it has none."""
    if address.scheme == "serial":
        return address.port_baud()[0]
    if address.scheme == "can" and address.target.startswith(_SLCAN):
        return address.target.removeprefix(_SLCAN)
    return ""


def _made(device: str) -> tuple[int, ...] | None:
    """Tells one making of a symbolic link from another; None for what is no link."""
    path = Path(device)
    if not path.is_symlink():
        return None
    status = path.lstat()
    return status.st_ino, status.st_mtime_ns
