"""`sim://swarm?...`: names and values are checked, and networks of one table share its time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from PIL import Image

from firmware_protocol.address import parse_address
from firmware_protocol.errors import AddressError, LinkClosedError
from firmware_protocol.links.memory import SharedLink, SharedTime
from firmware_protocol.wire.fields import CAN
from hil.connecting.connecting import AddressOpener, AddressOpeners
from hil.connecting.network_address import networks_of
from hil.connecting.swarm_address import robots_of, swarm_settings
from simdevice.swarm.world import SwarmWorld

if TYPE_CHECKING:
    from pathlib import Path


def test_what_is_not_given_has_its_default() -> None:
    settings = swarm_settings(parse_address("sim://swarm"))
    assert (settings.rangers, settings.wilds, settings.networks, settings.seed) == (25, 8, 1, 1)
    assert (settings.wire, settings.period, settings.wall, settings.ring, settings.occlusion) == (
        "mavlink",
        0.005,
        False,
        True,
        False,
    )
    assert (settings.size, settings.rooms, settings.profile.dropout, settings.profile.fix_sd) == (None, (), 0.0, 0.001)


def test_everything_can_be_said(tmp_path: Path) -> None:
    Image.new("L", (30, 20), 255).save(tmp_path / "hall.png")
    (tmp_path / "good.toml").write_text("fix_sd = 0.004\n")
    settings = swarm_settings(
        parse_address(
            "sim://swarm?rangers=3&wilds=2&wall=1&seed=9&networks=2&wire=can&dropout=0.5&occlusion=1&ring=0&period=10"
            f"&size=3,1.5&room=narrow&room={tmp_path}/hall.png&noise={tmp_path}/good.toml"
        )
    )
    assert (settings.rangers, settings.wilds, settings.networks, settings.seed) == (3, 2, 2, 9)
    assert (settings.wire, settings.period, settings.wall, settings.ring, settings.occlusion) == (CAN, 0.01, True, False, True)
    assert settings.size == (3.0, 1.5)
    assert [room.name for room in settings.rooms] == ["narrow", "hall"]
    assert (settings.profile.dropout, settings.profile.fix_sd) == (0.5, 0.004)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ("rangerz=1", "unknown option 'rangerz'. Known are: rangers, wilds, wall"),
        ("rangers=many", "rangers is a whole number, 0 to"),
        ("rangers=0&wilds=0", "at least one robot"),
        ("rangers=300", "253 robots: 308 robots need 2 networks"),
        ("rangers=300&wire=can", "126 robots: 308 robots need 3 networks"),
        ("rangers=3&wilds=0&networks=5", "do not fill 5 networks"),
        ("networks=0", "at least one network"),
        ("wall=yes", "wall is 0 or 1"),
        ("wire=radio", "wire is mavlink or can"),
        ("period=20", r"period is 5 or 10 \(ms\)"),
        ("noise=loud", "default, none, or a device profile"),
        ("noise=nowhere.toml", "nowhere.toml"),
        ("dropout=2", "0 to 1"),
        ("size=0", "a side or W,H in m"),
        ("size=1,2,3", "a side or W,H in m"),
        ("room=cellar", "default, narrow, mixed"),
        ("room=nowhere.png", "can't be read as an image"),
        ("rangers=500&networks=3&network=4", "network is 1 to 3"),
        ("faults=stuck:eye_left", "a micro-robot has none like that"),
        ("wall=1&size=0.2", "room for 33 robots"),
    ],
)
def test_what_can_t_be_is_said(options: str, told: str) -> None:
    with pytest.raises(AddressError, match=told) as raised:
        AddressOpeners().opener_of(parse_address(f"sim://swarm?{options}"))
    assert str(raised.value).count("sim://swarm") == 1


def test_one_link_is_one_network() -> None:
    with pytest.raises(AddressError, match="it has 3 networks"):
        AddressOpener(parse_address("sim://swarm?networks=3"))


def test_networks_have_addresses_of_their_own_and_one_clock() -> None:
    whole = parse_address("sim://swarm?rangers=4&wilds=1&networks=2")
    networks = networks_of(whole)
    assert [address.url for address in networks] == [f"{whole.url}&network={number}" for number in (1, 2)]
    assert [robots_of(address) for address in networks] == [3, 2]
    assert robots_of(whole) == 5
    openers = AddressOpeners()
    first, second = (openers.opener_of(address) for address in networks)
    with first.open() as link, second.open() as other:
        link.read(0.5)
        since = first.clock.now()
        assert since > 0.0
        assert second.clock.now() == 0.0
        while second.clock.now() < since:
            other.read(since - second.clock.now())
        assert second.clock.now() == since
    assert openers.opener_of(networks[0]).clock is first.clock
    assert AddressOpeners().opener_of(networks[0]).clock.now() == 0.0


def shared() -> tuple[SwarmWorld, SharedTime, SharedLink, SharedLink]:
    """A table with two networks, and its links."""
    world = SwarmWorld(swarm_settings(parse_address("sim://swarm?rangers=2&wilds=0&networks=2")))
    time = SharedTime(world)
    return world, time, SharedLink(time, 0, "one"), SharedLink(time, 1, "two")


def test_time_passes_once_for_all_networks_and_nothing_is_lost() -> None:
    world, time, one, two = shared()
    while time.clocks[0].now() < 1.2:
        one.read(1.2 - time.clocks[0].now())
    assert world.now() == pytest.approx(1.2)
    heard = []
    while time.clocks[1].now() < 1.2:
        if data := two.read(1.2 - time.clocks[1].now()):
            heard.append((time.clocks[1].now(), data))
    assert world.now() == pytest.approx(1.2), "it was let pass already"
    again, _, _, alone = shared()
    second = []
    while again.now() < 1.2:
        if data := alone.read(1.2 - again.now()):
            second.append((again.now(), data))
    assert heard == second
    assert heard


def test_nothing_passes_where_no_time_is_given() -> None:
    world, _, one, _ = shared()
    assert one.read(0.0) == b""
    assert world.now() == 0.0
    one.read(0.001)
    assert world.now() == world.period


def test_a_link_that_is_closed_says_so() -> None:
    _, _, one, two = shared()
    one.close()
    with pytest.raises(LinkClosedError):
        one.read(0.1)
    with pytest.raises(LinkClosedError):
        one.write(b"")
    two.write(b"")
