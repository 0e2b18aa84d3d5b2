"""From addresses to all the robots that are there: on one link, or on several."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar

from firmware_protocol.address import Address, parse_address
from firmware_protocol.links.serial import list_ports
from hil.bridge.clock import MonotonicClock
from hil.bridge.networks import GRID, Networks, RobotAddress
from hil.bridge.operator import Operator
from hil.connecting.connecting import AddressOpeners, asked_for, check_patience, open_bridge
from hil.connecting.handles import SETTLE, RobotHandles
from hil.connecting.network_address import networks_of, number_option
from hil.connecting.swarm_address import is_swarm, robots_of
from hil.safety import Limits
from hil.signing.key_file import load_key

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from firmware_protocol.links.serial import SerialPort
    from firmware_protocol.peer.fleets.fleet import Fleet
    from firmware_protocol.wire.signing import SigningKey
    from hil.bridge.taps import Tap
    from hil.connecting.connecting import NetworkOpener

GATHER: Final = GRID
"""In lock-step, what many robots say within so long is looked at together, in s: no network gets ahead of others by more."""

R = TypeVar("R", bound=RobotHandles[Any])


def connect_all_as(
    make: Callable[[Networks, Limits], R],
    *urls: str,
    settle: float = SETTLE,
    expect: int | Collection[int | RobotAddress] | None = None,
    timeout: float = 5.0,
    limits: Limits = Limits(),  # noqa: B008 - frozen
    taps: Sequence[Tap] = (),
    watch: bool = False,
    reconnect: float = 0.0,
    ports: Callable[[], Sequence[SerialPort]] = list_ports,
    signing_key: SigningKey | Path | str | None = None,
    operator: Operator | None = None,
    opener_of: Callable[[Address], NetworkOpener] | None = None,
    fleet_of: Callable[[float | None], Fleet] | None = None,
) -> R:
    """Connect to all robots on a link, or on several. They are stopped and disarmed by that, and so is who joins later.

    Args:
        make: Makes what holds the robots, of their open networks and the bounds on what is asked of each.
        *urls: Addresses as for `hil.connect`; each is a network of its own. `sim://junior?count=10` are ten emulated robots;
            `?system=` takes this robot of its network only.
        settle: The wait is over when no further robot was heard for this long, in s.
        expect: How many, or which, are expected: the wait is over when they are there, and no sooner. Of others none is
            taken where they are named by id. Emulated robots in this process are counted by themselves.
        timeout: Longest wait in s; those who are there by then are taken.
        limits: Bounds on what is asked of each robot.
        taps: What is shown everything that passes, on every network.
        watch: Open no sessions: the robots are looked at and neither stopped nor disarmed, until `RobotHandle.take`.
        reconnect: How long each link that is lost is tried to be opened again, in s; its robots leave and come back
            meanwhile. 0 does not: they are gone with their link.
        ports: Lists the serial ports of this machine, among which a lost one is looked for.
        signing_key: Key that host and robots sign with, on every network, or the file that holds it.
        operator: Whose keys and signals are taken in by the bridges' steps; None: nobody's.
        opener_of: Gives what opens the link of an address; None opens what it names.
        fleet_of: Makes what looks after the many robots of a network at once, by what its line carries, in bytes/s; None:
            each is looked after by itself.

    Returns:
        The robots; use it in a `with` block, which stops and disarms all on every way out.

    Raises:
        AddressError: A URL is no address we know.
        LinkOpenError: A link could not be opened; the text says what to do.
        NoRobotError: Nobody answered.
        VersionError: Nobody but robots with a protocol that we do not speak.
        ValueError: No address is given, one twice, or emulated ones together with others; `reconnect` is no time.
        KeyFileError: The key file can't be used.
    """
    if not urls:
        raise ValueError("connect_all needs the address of a link")
    patience = check_patience(reconnect)
    addresses = [network for url in urls for network in networks_of(parse_address(url))]
    key = load_key(Path(signing_key)) if isinstance(signing_key, str | Path) else signing_key
    if opener_of is None and addresses[0].scheme == "replay":
        from hil.replaying.opening import RecordedNetworks  # noqa: PLC0415 - only where it is wanted

        recorded = RecordedNetworks(addresses[0])
        addresses, opener_of = recorded.addresses, recorded.opener_of
    elif opener_of is None:
        gather = GATHER if fleet_of is not None else 0.0
        openers = AddressOpeners(ports, key, MonotonicClock(), gather=gather)  # one clock for all: their times are compared
        opener_of = openers.opener_of

    operator = operator or Operator()
    networks = Networks()
    robots = make(networks, limits)
    try:
        for address in addresses:
            bridge = open_bridge(
                address,
                opener_of(address),
                key,
                taps=[tap.of_network(address.url) for tap in taps] if len(addresses) > 1 else taps,
                robots=_allowed(address, expect),
                open_sessions=not watch,
                patience=patience,
                operator=operator,
                arrived=networks.wake,
                fleet_of=fleet_of,
            )
            try:
                networks.add(address.url, bridge)
            except ValueError:
                bridge.close()
                raise
        if expect is None and all(address.scheme == "sim" for address in addresses):
            expect = sum(1 if asked_for(address) else _emulated(address) for address in addresses)
        robots.find(settle=settle, expect=expect, timeout=timeout)
    except BaseException:
        robots.close()
        raise
    return robots


def _emulated(address: Address) -> int:
    """How many robots are emulated at an address."""
    return robots_of(address) if is_swarm(address) else number_option(address, "count") or 1


def _allowed(address: Address, expect: int | Collection[int | RobotAddress] | None) -> Collection[int] | None:
    """System ids of the robots to be taken on a network; None for all."""
    system = asked_for(address)
    if system is not None:
        return [system]
    if isinstance(expect, int | None):
        return None
    return {
        robot.system if isinstance(robot, RobotAddress) else robot
        for robot in expect
        if not isinstance(robot, RobotAddress) or robot.network == address.url
    }
