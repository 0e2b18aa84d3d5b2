"""Who has been heard on a network: a host that shares its link makes itself known, and is no robot."""

from __future__ import annotations

import pytest

from firmware_protocol.events import Received
from firmware_protocol.messages import HOST_COMPONENT, HOST_SYSTEM, SHARE_COMPONENT, Heartbeat, Statustext
from firmware_protocol.peer.timing import HOST_HEARTBEAT
from hil.bridge.acquaintances import Acquaintances
from hil.sharing.guests import SHARE

WORDS = "watching, coach drives"


def hears(*messages: tuple[int, int, Heartbeat | Statustext]) -> Acquaintances:
    """Somebody who has heard these."""
    found = Acquaintances(HOST_SYSTEM, None)
    for system, component, message in messages:
        assert not found.admits(Received(message, system, component, 0, 0.0, b""))
    return found


def test_a_link_is_ours_until_another_host_says_that_it_shares_it() -> None:
    assert hears().shared == ""
    assert hears((HOST_SYSTEM, HOST_COMPONENT, HOST_HEARTBEAT)).shared == ""
    assert hears((1, SHARE_COMPONENT, HOST_HEARTBEAT)).shared == ""
    assert hears((HOST_SYSTEM, HOST_COMPONENT, Statustext(6, WORDS))).shared == ""


@pytest.mark.parametrize(
    ("messages", "said"),
    [
        ([HOST_HEARTBEAT], "watching"),
        ([HOST_HEARTBEAT, Statustext(6, WORDS)], WORDS),
        ([Statustext(6, WORDS), HOST_HEARTBEAT], WORDS),
        ([Statustext(6, WORDS), Statustext(3, "coach has ended: nobody drives")], WORDS),
        ([Statustext(3, "4 programs look on already")], "watching"),
        ([HOST_HEARTBEAT, Statustext(6, "")], "watching"),
    ],
)
def test_what_is_said_of_who_drives(messages: list[Heartbeat | Statustext], said: str) -> None:
    found = hears(*[(*SHARE, message) for message in messages])
    assert found.shared == said
    assert found.strangers == set()
