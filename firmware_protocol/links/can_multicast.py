"""A CAN bus of UDP multicast, in python-can's format, that hears its own group and nobody else.

python-can's own bus joins on the network's interface and takes any datagram that reaches its port for a frame: another
machine's, and one sent to this machine alone. This one is kept to the loopback interface unless its frames may leave the
machine, and a datagram that was not sent to its group never reaches it.

How that is done depends on the system:

- Linux: the socket is bound to the group, so that the kernel passes on nothing that was sent elsewhere; it is a member on the
  loopback interface alone, and IP_MULTICAST_ALL is off, so that memberships of other programs do not count as ours.
- macOS: likewise, but for IP_MULTICAST_ALL, which is Linux's. Not tried.
- Windows: a socket cannot be bound to a group. A bus of this machine is bound to the loopback address, which other machines
  cannot reach; programs of this machine may still send datagrams to it alone, and buses of the same port hear each other. A
  bus that may leave the machine hears whatever is sent to its port. Not tried.
- IPv6: systems that route no IPv6 multicast over the loopback interface, as Linux usually, refuse such a bus of this machine.
"""

from __future__ import annotations

import contextlib
import ipaddress
import select
import socket
import struct
import sys
from typing import Any, Final

import can
from can.interfaces.udp_multicast.utils import pack_message, unpack_message

PORT: Final = 43113
"""python-can's own."""
_LARGEST: Final = 4096
"""Longest datagram looked at, in bytes."""
_IP_MULTICAST_ALL: Final = 49
_IPV6_MULTICAST_ALL: Final = 29
"""Options of Linux, which Python has no names for."""
_LOOPBACK: Final = "127.0.0.1"
_LOOPBACK_NAMES: Final = ("lo", "lo0", "loopback_0")
"""Of Linux, macOS and Windows."""


class MulticastBus(can.BusABC):
    """One member of the group.

    Args:
        channel: The group: a multicast address, as 239.74.163.2.
        port: UDP port of the bus.
        hop_limit: How many networks a frame may pass. 0 is a bus of this machine: its frames do not leave it, and it hears
            nobody else's.
        **kwargs: What any bus may be given and this one has no use for, as a bit rate.

    Raises:
        can.CanInitializationError: It is no group, or cannot be joined.
    """

    def __init__(self, channel: str, port: int = PORT, hop_limit: int = 0, **kwargs: object) -> None:  # noqa: ARG002
        try:
            group = ipaddress.ip_address(channel)
        except ValueError as error:
            raise can.CanInitializationError(str(error)) from error
        if not group.is_multicast:
            raise can.CanInitializationError(f"{channel} is not a multicast group")
        self._to = (str(group), port)
        self._socket = _open(group, port, hop_limit)
        self._send_timeout: float | None = None
        super().__init__(channel)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        """One frame of whoever speaks to the group; ours come back too."""
        try:
            if not select.select([self._socket], [], [], timeout)[0]:
                return None, False
            data = self._socket.recv(_LARGEST)
        except BlockingIOError:
            return None, False
        except OSError as error:
            raise can.CanOperationError("failed to read the socket") from error
        try:
            return unpack_message(data, check=True), False
        except Exception as error:  # whatever msgpack and python-can say of bytes that are no frame
            raise can.CanOperationError("what came is no frame") from error

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a frame to the group.

        Args:
            msg: The frame.
            timeout: How long it may take, in s.

        Raises:
            can.CanTimeoutError: It took longer.
            can.CanOperationError: The network is gone.
        """
        if timeout != self._send_timeout:
            self._send_timeout = timeout
            self._socket.settimeout(timeout)
        try:
            self._socket.sendto(pack_message(msg), self._to)
        except TimeoutError as error:
            raise can.CanTimeoutError("the socket takes nothing") from error
        except OSError as error:
            raise can.CanOperationError("failed to send to the group") from error

    def fileno(self) -> int:
        """File descriptor of the socket; -1 once it is closed."""
        return self._socket.fileno()

    def shutdown(self) -> None:
        """Leave the group."""
        super().shutdown()
        self._socket.close()


def _open(group: ipaddress.IPv4Address | ipaddress.IPv6Address, port: int, hop_limit: int) -> socket.socket:
    """Join a group."""
    family = socket.AF_INET if group.version == 4 else socket.AF_INET6
    opened = socket.socket(family, socket.SOCK_DGRAM)
    try:
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if hasattr(socket, "SO_REUSEPORT"):  # several programs of this machine are on one bus
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        if isinstance(group, ipaddress.IPv4Address):
            _join_4(opened, group, port, hop_limit)
        else:
            _join_6(opened, group, port, hop_limit)
    except OSError as error:
        opened.close()
        raise can.CanInitializationError(f"the group {group} cannot be joined ({error.strerror or error})") from error
    return opened


def _join_4(opened: socket.socket, group: ipaddress.IPv4Address, port: int, hop_limit: int) -> None:
    interface = socket.inet_aton(_LOOPBACK if hop_limit == 0 else "0.0.0.0")  # noqa: S104 - an interface to join on
    set_option = opened.setsockopt
    if sys.platform == "win32":
        opened.bind((_LOOPBACK if hop_limit == 0 else "", port))
    else:
        opened.bind((str(group), port))
    if sys.platform == "linux":
        set_option(socket.IPPROTO_IP, _IP_MULTICAST_ALL, 0)
    set_option(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, group.packed + interface)
    set_option(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, interface)
    set_option(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, hop_limit)
    set_option(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)


def _join_6(opened: socket.socket, group: ipaddress.IPv6Address, port: int, hop_limit: int) -> None:
    index = _loopback_index() if hop_limit == 0 else 0
    where: Any = ("::1" if hop_limit == 0 else "", port) if sys.platform == "win32" else (str(group), port, 0, index)
    set_option = opened.setsockopt
    opened.bind(where)
    if sys.platform == "linux":
        set_option(socket.IPPROTO_IPV6, _IPV6_MULTICAST_ALL, 0)
    set_option(socket.IPPROTO_IPV6, socket.IPV6_JOIN_GROUP, group.packed + struct.pack("@I", index))
    set_option(socket.IPPROTO_IPV6, socket.IPV6_MULTICAST_IF, index)
    set_option(socket.IPPROTO_IPV6, socket.IPV6_MULTICAST_HOPS, hop_limit)
    set_option(socket.IPPROTO_IPV6, socket.IPV6_MULTICAST_LOOP, 1)
    with socket.socket(
        socket.AF_INET6, socket.SOCK_DGRAM
    ) as tried:  # that no way leads there is known now, not at the first frame
        tried.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_MULTICAST_IF, index)
        tried.connect((str(group), port))


def _loopback_index() -> int:
    for name in _LOOPBACK_NAMES:
        with contextlib.suppress(OSError):
            return socket.if_nametoindex(name)
    raise OSError("this machine has no loopback interface")
