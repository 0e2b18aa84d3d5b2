"""A CAN bus of UDP multicast: what of a network's traffic gets in, and what does not. Linux's tables say where it listens."""

from __future__ import annotations

import os
import socket
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

import can
import pytest
from can.interfaces.udp_multicast.utils import pack_message
from link_kinds import PATIENCE

from firmware_protocol.address import parse_address
from firmware_protocol.errors import AddressError, LinkOpenError
from firmware_protocol.links.can import CanLink
from firmware_protocol.links.opening import open_link
from firmware_protocol.wire.can.frame import CanFrame
from simdevice.serving.can_endpoints import CanEndpoint
from simdevice.serving.opening import open_endpoint

if TYPE_CHECKING:
    from collections.abc import Callable

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells where a socket is a member")

PORT: Final = 20000 + os.getpid() % 20000
GROUP: Final = "239.74.163.9"
OTHER: Final = "239.74.163.10"
BUS: Final = f"can://udp_multicast/{GROUP}?port={PORT}"
FRAME: Final = CanFrame(0x123, b"\xab\xcd")
SECOND: Final = CanFrame(0x124, b"\1")
DATAGRAM: Final = pack_message(can.Message(arbitration_id=0x123, data=b"\xab\xcd", is_extended_id=False))


def host() -> tuple[Callable[[], bytes], Callable[[], None]]:
    """The host's end: what it hears, and how it is closed."""
    link = open_link(BUS)
    return lambda: link.read(0.02), link.close


def robot() -> tuple[Callable[[], bytes], Callable[[], None]]:
    """An emulated robot's end."""
    endpoint = CanEndpoint(parse_address(BUS))
    return lambda: endpoint.receive(0.0), endpoint.close


def say(data: bytes, to: str, interface: str = "127.0.0.1") -> None:
    """Send one datagram from elsewhere on this machine."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as speaker:
        speaker.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(interface))
        speaker.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        speaker.sendto(data, (to, PORT))


def memberships(group: str) -> set[str]:
    """The interfaces on which this machine is a member of a group, by Linux's own table."""
    wanted = socket.inet_aton(group)[::-1].hex().upper()
    found, interface = set(), ""
    for row in Path("/proc/net/igmp").read_text(encoding="ascii").splitlines()[1:]:
        fields = row.split()
        if row[0].isdigit():
            interface = fields[1]
        elif fields[0] == wanted:
            found.add(interface)
    return found


def outside() -> str:
    """An address of this machine on a network that knows multicast; skips the test where there is none."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as tried:
        try:
            tried.connect((GROUP, PORT))
        except OSError:
            pytest.skip("this machine has no network that knows multicast")
        return str(tried.getsockname()[0])


@pytest.mark.parametrize("end", [host, robot])
def test_a_datagram_sent_to_the_group_is_a_frame_and_one_sent_to_this_machine_or_another_group_is_none(
    end: Callable[[], tuple[Callable[[], bytes], Callable[[], None]]],
) -> None:
    heard, close = end()
    say(DATAGRAM, "127.0.0.1")  # while nobody else has the port, who might get it instead
    elsewhere = open_link(f"can://udp_multicast/{OTHER}?port={PORT}")  # this machine is a member of the other group too
    with open_link(BUS) as neighbour:
        say(DATAGRAM, OTHER)
        neighbour.write(SECOND.pack())
        came = b""
        for _ in range(100):  # what was sent before would have come before
            came += heard()
            if came:
                break
        assert came == SECOND.pack()
        assert heard() == b""
        assert elsewhere.read(PATIENCE) == FRAME.pack()
    elsewhere.close()
    close()


@pytest.mark.parametrize("end", [host, robot])
def test_a_bus_of_this_machine_listens_on_loopback_alone(
    end: Callable[[], tuple[Callable[[], bytes], Callable[[], None]]],
) -> None:
    assert memberships(GROUP) == set()
    heard, close = end()
    try:
        assert memberships(GROUP) == {"lo"}
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as joined:  # another program's membership is not ours
            interface = socket.inet_aton(outside())
            joined.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(GROUP) + interface)
            assert len(memberships(GROUP)) == 2
            say(DATAGRAM, GROUP, outside())
            say(DATAGRAM, "127.0.0.1")
            with open_link(BUS) as neighbour:
                neighbour.write(SECOND.pack())
            assert next(filter(None, (heard() for _ in range(100)))) == SECOND.pack()
    finally:
        close()
    assert memberships(GROUP) == set()


def test_a_bus_that_may_leave_the_machine_listens_on_the_network_and_still_to_its_group_alone() -> None:
    address = outside()
    with open_link(f"{BUS}&hop_limit=1") as link:
        assert memberships(GROUP) - {"lo"} == memberships(GROUP) != set()
        say(DATAGRAM, address)
        say(DATAGRAM, "127.0.0.1")
        say(DATAGRAM, GROUP, address)
        assert link.read(PATIENCE) == FRAME.pack()
        assert link.read(0.02) == b""


def test_what_is_no_frame_is_counted_and_ends_nothing() -> None:
    with open_link(BUS) as link, open_link(BUS) as neighbour:
        assert isinstance(link, CanLink)
        say(b"\xff" * 30, GROUP)
        say(b"", GROUP)
        neighbour.write(FRAME.pack())
        assert link.read(PATIENCE) == FRAME.pack()
        assert link.garbage == 2


@pytest.mark.parametrize(
    ("rest", "words"),
    [("10.1.2.3", "not a multicast group"), ("here", "here"), (f"{GROUP}?fd=true", "no option 'fd'.*hop_limit")],
)
def test_what_is_no_bus_is_explained(rest: str, words: str) -> None:
    with pytest.raises(LinkOpenError, match=words):
        open_link(f"can://udp_multicast/{rest}")


def test_a_robot_is_served_to_other_machines_only_where_that_is_asked_for() -> None:
    asked = f"{BUS}&hop_limit=1"
    with pytest.raises(AddressError, match="other machines"):
        open_endpoint(asked)
    outside()
    open_endpoint(asked, public=True).close()
