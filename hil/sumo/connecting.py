"""From an address to a Junior, or to all that are there."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.links.serial import list_ports
from hil.connecting.connecting import DEFAULT_URL, connect_as
from hil.connecting.connecting_all import connect_all_as
from hil.connecting.handles import SETTLE
from hil.safety import Limits
from hil.sumo.junior import Junior
from hil.sumo.robots import Robots

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence
    from pathlib import Path

    from firmware_protocol.address import Address
    from firmware_protocol.links.serial import SerialPort
    from firmware_protocol.wire.signing import SigningKey
    from hil.bridge.networks import RobotAddress
    from hil.bridge.operator import Operator
    from hil.bridge.taps import Tap
    from hil.connecting.connecting import NetworkOpener


def connect(
    url: str = DEFAULT_URL,
    *,
    system: int | None = None,
    timeout: float = 5.0,
    limits: Limits = Limits(),  # noqa: B008 - frozen
    taps: Sequence[Tap] = (),
    reconnect: float = 0.0,
    ports: Callable[[], Sequence[SerialPort]] = list_ports,
    signing_key: SigningKey | Path | str | None = None,
    operator: Operator | None = None,
    opener: NetworkOpener | None = None,
) -> Junior:
    """Connect to a Junior and do the handshake. The robot is stopped and disarmed by that, and no other one is.

    Args:
        url: `serial:///dev/ttyACM0:115200`, `tcp://127.0.0.1:5760`, `udpin://127.0.0.1:14550`, or an emulated robot in this
            process, in lock-step: `sim://junior?opponent=flat-light&seed=1`, with `&board=avr` on an emulated ATmega328P.
            `?system=` selects one of several robots, and
            `?faults=drop:0.05,corrupt:0.01,jitter:0.02` rehearses a bad line; with an emulated robot
            `?faults=stuck:eye_left@5+3,brownout:20` a bad robot too, and `?faults=@FILE.toml` what a file says.
            `replay:///path/log.mcap` gives this program what a log has recorded of the same program; where it asks otherwise
            than then, it gets a `ReplayDiverged` that names the step.
        system: System id of the robot; None takes the first Junior that answers.
        timeout: Longest wait for it in s.
        limits: Bounds on what is asked of it.
        taps: What is shown everything that passes: a `Recorder`, for instance.
        reconnect: How long a robot or link that is lost is waited for, in s: it is tried to open the link again, and to find
            the same robot there. `Junior.wait_until_back` waits for that. 0 does not: the link's end is an error.
        ports: Lists the serial ports of this machine, among which a lost one is looked for.
        signing_key: Key that robot and host sign with, or the file that holds it (`hil keygen` makes one). An emulated robot
            in this process comes up with it.
        operator: Whose keys and signals are taken in by the bridge's steps; None: nobody's.
        opener: Opens the link; None opens what the address names.

    Returns:
        The robot; use it in a `with` block, which stops the robot on every way out.

    Raises:
        AddressError: The URL is no address we know.
        LinkOpenError: The link could not be opened, or is too slow; the text says what to do.
        NoRobotError: Nobody answered as a robot.
        WrongRoleError: A robot did, and is no Junior.
        VersionError: It speaks a protocol we do not.
        ValueError: `reconnect` is no time.
        KeyFileError: The key file can't be used.
    """
    return connect_as(
        Junior,
        url,
        system=system,
        timeout=timeout,
        limits=limits,
        taps=taps,
        reconnect=reconnect,
        ports=ports,
        signing_key=signing_key,
        operator=operator,
        opener=opener,
    )


def connect_all(
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
) -> Robots:
    """Connect to all Juniors on a link, or on several. They are stopped and disarmed by that, and so is who joins later.

    Args:
        *urls: Addresses as for `connect`; each is a network of its own. `sim://junior?count=10` are ten emulated robots,
            `sim://junior?networks=2` two in one ring, each on a network of its own; `?system=` takes this robot of its network
            only.
        settle: The wait is over when no further robot was heard for this long, in s.
        expect: How many, or which, are expected: the wait is over when they are there, and no sooner. Of others none is
            taken where they are named by id. Emulated robots in this process are counted by themselves.
        timeout: Longest wait in s; those who are there by then are taken.
        limits: Bounds on what is asked of each robot.
        taps: What is shown everything that passes, on every network.
        watch: Open no sessions: the robots are looked at and neither stopped nor disarmed, until `Junior.take`.
        reconnect: How long each link that is lost is tried to be opened again, in s; its robots leave and come back
            meanwhile. 0 does not: they are gone with their link.
        ports: Lists the serial ports of this machine, among which a lost one is looked for.
        signing_key: Key that host and robots sign with, on every network, or the file that holds it.
        operator: Whose keys and signals are taken in by the bridges' steps; None: nobody's.
        opener_of: Gives what opens the link of an address; None opens what it names.

    Returns:
        The robots; use it in a `with` block, which stops and disarms all on every way out.

    Raises:
        AddressError: A URL is no address we know.
        LinkOpenError: A link could not be opened; the text says what to do.
        NoRobotError: Nobody answered.
        WrongRoleError: Nobody but robots that are no Juniors.
        VersionError: Nobody but robots with a protocol that we do not speak.
        ValueError: No address is given, one twice, or emulated ones together with others; `reconnect` is no time.
        KeyFileError: The key file can't be used.
    """
    return connect_all_as(
        Robots,
        *urls,
        settle=settle,
        expect=expect,
        timeout=timeout,
        limits=limits,
        taps=taps,
        watch=watch,
        reconnect=reconnect,
        ports=ports,
        signing_key=signing_key,
        operator=operator,
        opener_of=opener_of,
    )
