"""A link over a CAN bus, through any of python-can's interfaces; nobody else touches python-can.

What is read and written are classical CAN frames in the serial form of `firmware_protocol.wire.can.frame`. Remote, CAN FD and
error frames are not passed on; what error frames say of the bus is told by `news`.
"""

from __future__ import annotations

import contextlib
import errno
import inspect
import threading
from collections import deque
from time import monotonic
from typing import TYPE_CHECKING, Any, Final

import can
import serial
from can.interfaces.slcan import slcanBus

from firmware_protocol.address import whole_number
from firmware_protocol.errors import AddressError, LinkClosedError, LinkOpenError, LinkTimeoutError
from firmware_protocol.link import Link
from firmware_protocol.links.can_multicast import MulticastBus
from firmware_protocol.wire.can.frame import CanFrame, split_records
from firmware_protocol.wire.can.layout import LAST_NODE
from firmware_protocol.wire.fields import CAN

if TYPE_CHECKING:
    from firmware_protocol.address import Address

SEND_TIMEOUT: Final = 0.2
"""Longest wait for a frame to be taken, in s."""
_RETRY: Final = 0.001
"""A full queue is tried again after this, in s: a frame's time on a slow bus."""
_CHUNK: Final = 256
"""Most frames handed over at once."""
_NOT_OURS: Final = frozenset({"system", "node", "faults", "seed"})
"""Options of an address that select a robot or rehearse faults."""
_GONE: Final = frozenset({errno.ENODEV, errno.ENXIO, errno.EIO, errno.EBADF, errno.ENETDOWN})
_BABBLING: Final = frozenset({"udp_multicast", "slcan"})
"""Interfaces whose driver raises for what others put on the wire; that is noise to us."""

_ECHOING: Final = frozenset({"udp_multicast"})
"""Interfaces that give us back what we have sent; such frames are dropped. Host and robot never send the same frame."""
_ECHOES: Final = 1024
"""Frames sent that may yet come back."""

_STRICT: Final = frozenset({"socketcan", "slcan", "udp_multicast", "virtual"})
"""Interfaces whose options are all known; python-can itself lets a misspelt one pass without a word."""
_GREATEST: Final = {"port": 65535, "hop_limit": 255}
"""Of numbers on which python-can would stumble and leave a socket behind."""

OFF_LIMIT: Final = 2.0
"""A bus-off that lasts so long ends the link, in s: opening it anew resets most adapters."""

ERROR_CONTROLLER: Final = 0x004
ERROR_BUS_OFF: Final = 0x040
ERROR_RESTARTED: Final = 0x100
"""Classes of error frames (linux/can/error.h)."""
_PASSIVE: Final = 0x30
_WARNING: Final = 0x0C
_ACTIVE: Final = 0x40
"""Bits of the controller's state, byte 1 of such a frame."""

WELL: Final = "the CAN bus works again"
WARNING: Final = "the CAN controller counts many errors: check the wiring and the terminating resistors"
PASSIVE: Final = "the CAN controller is error passive: nobody acknowledges, or the bit rates differ"
BUS_OFF: Final = (
    "the CAN controller is bus-off and sends nothing: check wiring and bit rate. "
    "A socketcan interface comes back by itself after: ip link set can0 type can restart-ms 100"
)


class CanLink(Link):
    """An open CAN bus.

    Args:
        url: Name of the link in messages and logs.
        bus: The bus, of python-can; shut down with the link.
        interface: Its kind, as python-can calls it.
    """

    wire = CAN

    def __init__(self, url: str, bus: can.BusABC, interface: str) -> None:
        self.url = url
        self.garbage = 0
        self._bus = bus
        self._babbling = interface in _BABBLING
        self._echoes: deque[bytes] | None = deque(maxlen=_ECHOES) if interface in _ECHOING else None
        self._lock = threading.Lock()
        self._full = threading.Event()  # never set: to wait by
        self._state = WELL
        self._watched = False
        self._off_since: float | None = None
        self._news: deque[str] = deque()
        self._closed = False

    def fileno(self) -> int:
        """File descriptor that becomes readable when frames come; -1 where the interface has none."""
        try:
            return self._bus.fileno()
        except (NotImplementedError, can.CanError):
            return -1

    def news(self) -> list[str]:
        """What the bus's state has become since the last call, in words."""
        return [self._news.popleft() for _ in range(len(self._news))]

    def write(self, data: bytes) -> None:
        """Send whole frames in serial form. A queue that is full is waited for.

        Raises:
            LinkClosedError: The bus is gone.
            LinkTimeoutError: A frame was not taken in time; it and those behind it are lost.
            ValueError: The bytes are no frames.
        """
        if self._closed:
            raise LinkClosedError(self.url, "the link is closed")
        for record in split_records(data):
            frame = CanFrame.unpack(record)
            message = can.Message(arbitration_id=frame.identifier, data=frame.data, is_extended_id=frame.extended, check=False)
            if self._echoes is not None:
                with self._lock:
                    self._echoes.append(record)
            self._send(message)

    def _send(self, message: can.Message) -> None:
        """Send one frame."""
        tries = round(SEND_TIMEOUT / _RETRY)
        while True:
            try:
                self._bus.send(message, SEND_TIMEOUT)
            except (can.CanError, OSError) as error:
                tries -= 1
                if _errno(error) == errno.ENOBUFS and tries > 0:  # Linux's queue of an interface, of 10 frames by default
                    self._full.wait(_RETRY)
                    continue
                if self._is_gone(error):
                    raise LinkClosedError(self.url, f"the CAN bus is gone ({error})") from error
                raise LinkTimeoutError(self.url, f"the CAN bus takes no frames ({error})") from error
            return

    def _is_gone(self, error: BaseException) -> bool:
        """Whether what sending said means that there is no bus any more."""
        if isinstance(self._bus, slcanBus):  # pyserial's errors have no number
            return not any(isinstance(cause, serial.SerialTimeoutException) for cause in (error, error.__cause__))
        return _errno(error) in _GONE

    def read(self, timeout: float) -> bytes:
        """Wait for frames, at most `timeout` s. What is no frame for us, as an echo of our own, does not end the wait.

        Returns:
            Frames in serial form.
        """
        if self._closed:
            raise LinkClosedError(self.url, "the link is closed")
        deadline = monotonic() + timeout
        records: list[bytes] = []
        while True:
            message = self._receive(max(0.0, deadline - monotonic()))
            while message is not None:
                self._take(message, records)
                if len(records) >= _CHUNK or not self._more():
                    break
                message = self._receive(0.0)
            if records:
                return b"".join(records)
            if monotonic() >= deadline:
                self._watch()
                self._bear()
                return b""

    def close(self) -> None:
        """Leave the bus."""
        if not self._closed:
            self._closed = True
            with contextlib.suppress(can.CanError, OSError):
                self._bus.shutdown()
            if isinstance(self._bus, slcanBus):  # where the adapter is gone, its driver gives up before it closes the port
                with contextlib.suppress(OSError):
                    self._bus.serialPortOrig.close()

    def _receive(self, timeout: float) -> can.Message | None:
        """One frame of any kind."""
        try:
            return self._bus.recv(timeout)
        except (can.CanError, OSError) as error:
            if not self._babbling or _errno(error) is not None or isinstance(error.__cause__, OSError):
                raise LinkClosedError(self.url, f"the CAN bus is gone ({error})") from error
        except (ValueError, IndexError, KeyError, TypeError):  # what a driver says to bytes that are no frame
            pass
        self.garbage += 1
        if isinstance(self._bus, slcanBus):  # it keeps bytes that are no text, and would stumble over them for ever
            with contextlib.suppress(can.CanError):
                self._bus.flush()
        return None

    def _more(self) -> bool:
        """Whether it is worth looking for a further frame; the driver of serial adapters would wait for one a millisecond."""
        if not isinstance(self._bus, slcanBus):
            return True
        try:
            return bool(self._bus.serialPortOrig.in_waiting)
        except OSError:
            return False

    def _take(self, message: can.Message, records: list[bytes]) -> None:
        """Pass on a data frame; look at an error frame."""
        if message.is_error_frame:
            self._error(message.arbitration_id, bytes(message.data))
        elif not message.is_remote_frame and not message.is_fd:
            try:
                frame = CanFrame(message.arbitration_id, bytes(message.data), message.is_extended_id)
            except ValueError:
                self.garbage += 1
            else:
                record = frame.pack()
                if not self._is_echo(record):
                    records.append(record)

    def _is_echo(self, record: bytes) -> bool:
        """Whether we have sent this frame ourselves."""
        if not self._echoes:
            return False
        with self._lock:
            try:
                self._echoes.remove(record)
            except ValueError:
                return False
        return True

    def _error(self, kind: int, data: bytes) -> None:
        """Read an error frame of socketcan."""
        status = data[1] if kind & ERROR_CONTROLLER and len(data) > 1 else 0
        if kind & ERROR_BUS_OFF:
            self._become(BUS_OFF)
        elif kind & ERROR_RESTARTED or status & _ACTIVE:
            self._become(WELL)
        elif status & _PASSIVE:
            self._become(PASSIVE)
        elif status & _WARNING:
            self._become(WARNING)

    def _watch(self) -> None:
        """Ask a driver that knows how the bus is; most have nothing to say and seem well."""
        try:
            state = self._bus.state
        except (NotImplementedError, can.CanError, OSError):
            return
        if state is not can.BusState.ACTIVE:
            self._watched = True
            self._become(BUS_OFF if state is can.BusState.ERROR else PASSIVE)
        elif self._watched:
            self._watched = False
            self._become(WELL)

    def _bear(self) -> None:
        """Bear a bus-off for a while, from which many controllers recover by themselves.

        Raises:
            LinkClosedError: For long enough.
        """
        if self._state != BUS_OFF:
            self._off_since = None
        elif self._off_since is None:
            self._off_since = monotonic()
        elif monotonic() - self._off_since >= OFF_LIMIT:
            raise LinkClosedError(self.url, f"the CAN controller was bus-off for {OFF_LIMIT:g} s: check wiring and bit rate")

    def _become(self, state: str) -> None:
        if state != self._state:
            self._state = state
            self._news.append(state)


def open_can(address: Address) -> CanLink:
    """Open a bus.

    Args:
        address: `can://INTERFACE/CHANNEL`, such as `can://socketcan/can0`, `can://slcan//dev/ttyUSB0?bitrate=500000`,
            `can://udp_multicast/239.74.163.2` or `can://virtual/NAME`; any interface of python-can, with its own options
            behind `?`. `udp_multicast` is a bus of this machine, which no other machine hears or is heard on, unless
            `hop_limit` says otherwise.

    Raises:
        AddressError: No interface or channel is named, an option that the interface does not have, or a robot that can be
            on no bus.
        LinkOpenError: python-can cannot open the bus.
    """
    url = address.url
    interface, _, channel = address.target.partition("/")
    if not interface or not channel:
        raise AddressError(url, "the address is not can://INTERFACE/CHANNEL", "Write for instance can://socketcan/can0")
    options: dict[str, Any] = {name: _value(text) for name, text in address.options.items() if name not in _NOT_OURS}
    if interface not in can.VALID_INTERFACES:
        known = ", ".join(sorted(can.VALID_INTERFACES))
        raise AddressError(url, f"python-can has no interface {interface!r}", f"It has {known}")
    _check_options(address, interface, options)
    try:
        if interface == "udp_multicast":
            bus: can.BusABC = MulticastBus(channel, **options)
        else:
            bus = can.Bus(channel=channel, interface=interface, ignore_config=True, **options)
    except (
        can.CanError,
        OSError,
        ImportError,
        ArithmeticError,
        ValueError,
        TypeError,
        AttributeError,
        NotImplementedError,
    ) as error:
        refused = isinstance(error, (ArithmeticError, ValueError, TypeError))
        remedy = "Correct the options of the address" if refused else _remedy(interface, channel, error)
        raise LinkOpenError(url, f"cannot open the CAN bus: {str(error).rstrip('.')}", remedy) from error
    return CanLink(url, bus, interface)


def _check_options(address: Address, interface: str, options: dict[str, Any]) -> None:
    """See that an address asks for a robot that can be on a bus, and for nothing that would be overlooked."""
    for name in ("node", "system"):
        text = address.options.get(name, "1")
        if not whole_number(text, LAST_NODE):
            raise AddressError(address.url, f"{name} is 1 to {LAST_NODE} on a CAN bus, not {text[:40]!r}")
    if interface not in _STRICT:
        return
    kind = can.interface._get_class_for_interface(interface)  # noqa: SLF001 - no public way to ask
    kinds = (MulticastBus,) if interface == "udp_multicast" else kind.__mro__[:-1]
    known = {name for kind in kinds for name in inspect.signature(kind).parameters}
    known = (known | {"bitrate"}) - {"args", "kwargs", "channel", "can_filters"}
    if strange := options.keys() - known:
        raise AddressError(address.url, f"{interface} has no option {min(strange)!r}", f"It has {', '.join(sorted(known))}")
    for name, greatest in _GREATEST.items():
        if name in options and not (isinstance(options[name], int) and 0 <= options[name] <= greatest):
            raise AddressError(address.url, f"{name} is 0 to {greatest}, not {options[name]!r}")


def _value(text: str) -> int | float | bool | str:
    """An option of python-can from an address."""
    if text in {"true", "false"}:
        return text == "true"
    for kind in (int, float):
        with contextlib.suppress(ValueError):
            return kind(text)
    return text


def _errno(error: BaseException) -> int | None:
    """The system's error number behind an error of python-can."""
    cause: BaseException | None = error
    while cause is not None:
        number = getattr(cause, "errno", None) or getattr(cause, "error_code", None)
        if isinstance(number, int):
            return number
        cause = cause.__cause__
    return None


def _remedy(interface: str, channel: str, error: BaseException) -> str:
    """What to do when a bus can't be opened."""
    number = _errno(error)
    if interface == "socketcan":
        return (
            f"Is there an interface {channel}? ip link shows it; bring it up by: "
            f"sudo ip link set {channel} up type can bitrate 500000 restart-ms 100"
        )
    if interface == "slcan":
        if number == errno.EACCES:
            return "You may not use this port: add yourself to the group dialout, then log in again"
        return f"Is the adapter plugged in, at {channel}, and no other program using it? hil ports lists the ports"
    if interface == "udp_multicast":
        return "The channel is an IPv4 multicast group, as 239.74.163.2; with hop_limit, the machine needs a network as well"
    return f"python-can's documentation tells what its interface {interface} needs"
