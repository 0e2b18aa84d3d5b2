"""From an address to a robot: the one place where an emulated robot and a physical one part ways."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeVar

from firmware_protocol.address import Address, parse_address
from firmware_protocol.errors import AddressError, FaultSpecError
from firmware_protocol.links.faulty import FaultyLink
from firmware_protocol.links.gathering import GatheringLink
from firmware_protocol.links.memory import MemoryLink, SharedLink, SharedTime
from firmware_protocol.links.reopen import LinkOpener
from firmware_protocol.links.serial import list_ports
from firmware_protocol.wire.codec import SPLITTERS
from firmware_protocol.wire.fields import MAVLINK
from hil.bridge.bridge import Bridge
from hil.bridge.clock import LastReading, MonotonicClock
from hil.bridge.operator import Operator
from hil.bridge.pump import open_pump
from hil.bridge.reopening import Opener, Reopening
from hil.bridge.sessions import random_session
from hil.connecting.handle import RobotHandle
from hil.connecting.junior_address import junior_settings
from hil.connecting.lines import capacity_of, pace_of
from hil.connecting.network_address import network_of, number_option, whole_of
from hil.connecting.swarm_address import is_swarm, swarm_settings
from hil.files.fault_file import fault_file_of, read_faults
from hil.safety import Limits
from hil.seeds import Branch, generator
from hil.signing.key_file import calendar, load_key, open_signing

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from firmware_protocol.clock import Clock
    from firmware_protocol.faults.spec import FaultSpec
    from firmware_protocol.link import Link
    from firmware_protocol.links.serial import SerialPort
    from firmware_protocol.peer.fleets.fleet import Fleet
    from firmware_protocol.wire.signing import SigningKey
    from hil.bridge.pump import Pump
    from hil.bridge.taps import Tap
    from simdevice.sumo.crowd import Crowd
    from simdevice.sumo.world import World
    from simdevice.swarm.settings import SwarmSettings
    from simdevice.swarm.world import SwarmWorld

H = TypeVar("H", bound=RobotHandle)

DEFAULT_URL = "sim://junior"


def connect_as(
    make: type[H],
    url: str,
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
) -> H:
    """Connect to a robot and do the handshake. The robot is stopped and disarmed by that, and no other one is.

    Args:
        make: The kind of handle that is wanted; a robot that has not the role for it is not taken.
        url: As for `hil.connect`.
        system: System id of the robot; None takes the first that answers and has the role.
        timeout: Longest wait for it in s.
        limits: Bounds on what is asked of it.
        taps: What is shown everything that passes.
        reconnect: How long a robot or link that is lost is waited for, in s.
        ports: Lists the serial ports of this machine, among which a lost one is looked for.
        signing_key: Key that robot and host sign with, or the file that holds it.
        operator: Whose keys and signals are taken in by the bridge's steps; None: nobody's.
        opener: Opens the link; None opens what the address names.

    Returns:
        The handle; use it in a `with` block, which stops the robot on every way out.

    Raises:
        AddressError: The URL is no address we know.
        LinkOpenError: The link could not be opened, or is too slow; the text says what to do.
        NoRobotError: Nobody answered as a robot.
        WrongRoleError: A robot did, and has another role.
        VersionError: It speaks a protocol we do not.
        ValueError: `reconnect` is no time.
        KeyFileError: The key file can't be used.
    """
    address = parse_address(url)
    patience = check_patience(reconnect)
    key = load_key(Path(signing_key)) if isinstance(signing_key, str | Path) else signing_key
    if opener is None:
        if address.scheme == "replay":
            address, opener = _recorded(address)
        else:
            opener = AddressOpener(address, ports, key)
    if system is None:
        system = asked_for(address)
    bridge = open_bridge(
        address,
        opener,
        key,
        taps=taps,
        robots=None if system is None else [system],
        open_sessions=False,
        patience=patience,
        operator=operator,
    )
    robot = make(bridge, limits)
    try:
        robot.find(system, timeout)
    except BaseException:
        robot.close()
        raise
    return robot


def _recorded(address: Address) -> tuple[Address, NetworkOpener]:
    """The only network of a log, and what opens it."""
    from hil.replaying.opening import RecordedNetworks  # noqa: PLC0415 - only where it is wanted

    networks = RecordedNetworks(address)
    if len(networks.addresses) > 1:
        raise AddressError(address.url, f"the log has {len(networks.addresses)} networks", "Use connect_all")
    return networks.addresses[0], networks.opener_of(networks.addresses[0])


def check_patience(reconnect: float) -> float:
    """See that a time can be waited for.

    Args:
        reconnect: How long to wait for a robot that was lost, in s.

    Returns:
        Likewise.

    Raises:
        ValueError: It is negative, or no number.
    """
    if not 0 <= reconnect < float("inf"):
        raise ValueError(f"the time to wait for a lost robot is a number of seconds, 0 or more, not {reconnect:g}")
    return reconnect


class NetworkOpener(Opener, Protocol):
    """Opens the link of one network, again and again, and has what else a bridge needs."""

    @property
    def faults(self) -> FaultSpec | None:
        """What goes wrong with the line and with an emulated robot; None where nothing is asked for."""
        ...

    @property
    def clock(self) -> Clock:
        """The clock that the link runs by."""
        ...

    @property
    def session(self) -> Callable[[], int]:
        """A source of session numbers."""
        ...

    def pump(self, link: Link, reopening: Reopening | None, arrived: Callable[[], None] | None, operator: Operator) -> Pump:
        """What hands over what the link brings."""
        ...

    def signing_time(self) -> int:
        """The calendar, as signatures carry it, in 10 us since 2015-01-01 GMT."""
        ...


def open_bridge(
    address: Address,
    opener: NetworkOpener,
    key: SigningKey | None,
    *,
    taps: Sequence[Tap],
    robots: Collection[int] | None,
    open_sessions: bool,
    patience: float,
    operator: Operator | None = None,
    arrived: Callable[[], None] | None = None,
    fleet_of: Callable[[float | None], Fleet] | None = None,
) -> Bridge:
    """Open a network, and begin to serve it.

    Args:
        address: Its address; also its name.
        opener: Opens its link.
        key: Signing key.
        taps: As in `Bridge`, and what follows likewise.
        robots: Likewise.
        open_sessions: Likewise.
        patience: Likewise.
        operator: Likewise.
        arrived: Likewise.
        fleet_of: Makes what looks after many robots at once, by what the line carries, in bytes/s; None: each is looked after
            by itself.

    Raises:
        AddressError: Nothing can be signed on this link.
        LinkOpenError: The link could not be opened.
    """
    pace = pace_of(address, opener.faults, signed=key is not None) if fleet_of is None else None
    link = opener.open()
    reading = LastReading(opener.clock)
    reopening = Reopening(opener, patience) if patience > 0 else None
    signing = open_signing(key, link, reading, opener.signing_time)
    operator = operator or Operator()
    kind: Callable[..., Bridge] = Bridge
    if fleet_of is not None:
        from hil.bridge.fleet_bridge import FleetBridge  # noqa: PLC0415 - numpy is only needed here

        kind = partial(FleetBridge, fleet=fleet_of(capacity_of(address, opener.faults)))
    return kind(
        link,
        reading,
        taps=taps,
        robots=robots,
        open_sessions=open_sessions,
        session=opener.session,
        reopening=reopening,
        pump=opener.pump(link, reopening, arrived, operator),
        arrived=arrived,
        operator=operator,
        network=address.url,
        signing=signing,
        pace=pace,
    )


class AddressOpener:
    """Opens what an address names, again and again: see `hil.bridge.reopening.Opener`.

    Faults go on, from where their chance stood, on every link opened; an emulated robot in this process lives on while there
    is no link to it.

    Args:
        address: The address, taken apart.
        ports: Lists the serial ports of this machine.
        key: Signing key that an emulated robot in this process comes up with.
        clock: Tells the time in real time; None makes one.
        table: What several networks of one emulated table share; None where the address is all that there is.
        gather: In lock-step, what comes within so long comes together, in s; 0: it comes at once.

    Attributes:
        faults: What goes wrong with the line and with an emulated robot; None where nothing is asked for.
        clock: The clock that the link runs by.
        session: A source of session numbers.

    Raises:
        AddressError: The URL is no address we know.
    """

    def __init__(
        self,
        address: Address,
        ports: Callable[[], Sequence[SerialPort]] = list_ports,
        key: SigningKey | None = None,
        clock: Clock | None = None,
        table: SharedTime | None = None,
        *,
        gather: float = 0.0,
    ) -> None:
        seed = number_option(address, "seed") or 0
        self.faults = fault_option(address)
        self.clock: Clock
        self.session: Callable[[], int] = random_session
        self._inner: Callable[[], Link]
        if address.scheme == "sim":
            if table is None:
                world = _emulated(address, self.faults, key)
                self.clock = world
                self._inner = lambda: MemoryLink(world, address.url, wire=world.wire)
            else:
                wire, network = address.options.get("wire", MAVLINK), network_of(address) - 1
                self.clock = table.clocks[network]
                self._inner = lambda: SharedLink(table, network, address.url, wire=wire)
            numbers = generator(seed, Branch.SESSION)
            self.session = lambda: int(numbers.integers(1, 0x10000))
        else:
            self.clock = clock or MonotonicClock()
            bare, _, options = address.url.partition("?")
            kept = "&".join(option for option in options.split("&") if option and not option.startswith(("faults=", "seed=")))
            self._inner = LinkOpener(f"{bare}?{kept}" if kept else bare, ports).open
        self._seed = seed
        self._faulty: FaultyLink | None = None
        self._gather = gather

    def open(self) -> Link:
        """Open the link.

        Raises:
            AddressError: The URL is no address we know.
            LinkOpenError: The link could not be opened.
        """
        link = self._open()
        return GatheringLink(link, self.clock, self._gather) if self._gather and link.lockstep else link

    def _open(self) -> Link:
        if self.faults is None:
            return self._inner()
        if self._faulty is None:
            link = self._inner()
            self._faulty = FaultyLink(link, self.faults, seed=self._seed, clock=self.clock, split=SPLITTERS[link.wire])
        else:
            self._faulty.open_again(self._inner)
        return self._faulty

    def pump(
        self,
        link: Link,
        reopening: Reopening | None,
        arrived: Callable[[], None] | None,
        operator: Operator,  # noqa: ARG002 - a log's is its pump's business
    ) -> Pump:
        """What hands over what the link brings."""
        return open_pump(link, self.clock, reopening, arrived)

    def signing_time(self) -> int:
        """The calendar, as signatures carry it, in 10 us since 2015-01-01 GMT."""
        return calendar()

    def let_pass(self, duration: float) -> None:
        """Let the emulated robot in this process live on, unheard.

        Args:
            duration: In s, rounded up to whole control periods.
        """
        end = self.clock.now() + duration - 1e-9
        with self._inner() as nobody:
            while self.clock.now() < end:
                nobody.read(end - self.clock.now())


class AddressOpeners:
    """Opens the networks of one program: those of one emulated table share it, and its clock.

    Args:
        ports: Lists the serial ports of this machine.
        key: Signing key.
        clock: Tells the time of those that run in real time.
        gather: As of `AddressOpener`.
    """

    def __init__(
        self,
        ports: Callable[[], Sequence[SerialPort]] = list_ports,
        key: SigningKey | None = None,
        clock: Clock | None = None,
        *,
        gather: float = 0.0,
    ) -> None:
        self._gather = gather
        self._ports = ports
        self._key = key
        self._clock = clock
        self._tables: dict[str, SharedTime] = {}

    def opener_of(self, address: Address) -> AddressOpener:
        """What opens the link of an address.

        Args:
            address: The address; of a table with several networks, one of `networks_of`.

        Raises:
            AddressError: The URL is no address we know.
        """
        if not network_of(address):
            return AddressOpener(address, self._ports, self._key, self._clock, gather=self._gather)
        whole = whole_of(address)
        if whole not in self._tables:
            self._tables[whole] = _networked(address, self._key)
        return AddressOpener(address, self._ports, self._key, self._clock, self._tables[whole], gather=self._gather)


def asked_for(address: Address) -> int | None:
    """The system id, or on CAN the node id, that an address asks for; None where it leaves that open.

    Args:
        address: The address, taken apart.

    Raises:
        AddressError: It is no whole number.
    """
    return number_option(address, "node" if "node" in address.options else "system")


def with_system(url: str, system: int) -> str:
    """The address of one of several robots on a link.

    Args:
        url: Address of the link; a robot that it names already is replaced.
        system: System id, or on CAN node id, of the robot.
    """
    bare, _, options = url.partition("?")
    kept = [option for option in options.split("&") if option and not option.startswith(("system=", "node="))]
    name = "node" if url.startswith("can:") else "system"
    return f"{bare}?{'&'.join([*kept, f'{name}={system}'])}"


def open_address(address: Address, key: SigningKey | None = None) -> tuple[Link, Clock, Callable[[], int]]:
    """Open what an address names, once.

    Args:
        address: The address, taken apart.
        key: Signing key that an emulated robot in this process comes up with.

    Returns:
        The link, the clock it runs by, and a source of session numbers.

    Raises:
        AddressError: The URL is no address we know.
        LinkOpenError: The link could not be opened.
    """
    opener = AddressOpener(address, key=key)
    return opener.open(), opener.clock, opener.session


def fault_option(address: Address) -> FaultSpec | None:
    """The faults that an address asks for.

    Args:
        address: The address, taken apart.

    Returns:
        What is to go wrong; None where nothing is asked for.

    Raises:
        AddressError: Something of it is wrong, or befalls a robot that we do not emulate.
    """
    text = address.options.get("faults")
    if text is None:
        return None
    try:
        spec = read_faults(text)
    except FaultSpecError as error:
        raise AddressError(address.url, f"faults: {error}") from error
    if spec.of_device and address.scheme != "sim":
        raise AddressError(
            address.url,
            f"the fault '{spec.of_device[0]}' is one of the robot itself, and this robot is not emulated here",
            "Give it to `hil emulate --faults`, or have a real robot rehearse it with Junior.inject_failure",
        )
    return spec


def fault_file(address: Address) -> bytes | None:
    """The content of the file that an address takes its faults from; None where it names none.

    Args:
        address: The address, taken apart.

    Raises:
        AddressError: It can't be read.
    """
    try:
        return fault_file_of(address.options.get("faults", ""))
    except FaultSpecError as error:
        raise AddressError(address.url, f"faults: {error}") from error


def _befalling(address: Address) -> FaultSpec | None:
    """What befalls the robots of an address, if anything does."""
    faults = fault_option(address)
    return faults if faults is not None and faults.of_device else None


def _swarm(address: Address, key: SigningKey | None) -> SwarmWorld:
    """Emulated micro-robots on one network, and their table."""
    settings = swarm_settings(address, _befalling(address))
    if settings.networks > 1:
        raise AddressError(address.url, f"it has {settings.networks} networks", "Use connect_swarm, or connect_all")
    if key is not None:
        raise AddressError(address.url, "emulated micro-robots come without a signing key", "Leave --signing-key out")
    return _table(address, settings)


def _table(address: Address, settings: SwarmSettings) -> SwarmWorld:
    """A table with emulated micro-robots."""
    from simdevice.swarm.world import SwarmWorld  # noqa: PLC0415 - pymunk is only needed here

    try:
        return SwarmWorld(settings)
    except ValueError as error:
        raise AddressError(address.url, str(error)) from error


def _emulated(address: Address, faults: FaultSpec | None, key: SigningKey | None) -> World | Crowd | SwarmWorld:
    """An emulated robot in this process, or several."""
    if is_swarm(address):
        return _swarm(address, key)
    from simdevice.sumo.crowd import Crowd  # noqa: PLC0415 - pymunk is only needed here
    from simdevice.sumo.junior_world import junior_world  # noqa: PLC0415

    settings, count = junior_settings(address, faults, key), number_option(address, "count")
    if settings.hosted:
        raise AddressError(address.url, "two robots are in its ring, each on a network of its own", "Use connect_all")
    try:
        return junior_world(settings) if count is None else Crowd(count, settings)
    except ValueError as error:
        raise AddressError(address.url, str(error)) from error


def _networked(address: Address, key: SigningKey | None) -> SharedTime:
    """What several networks of one emulated place share; a swarm's robots are too many to be heard one by one."""
    if is_swarm(address):
        return SharedTime(_table(address, swarm_settings(address, _befalling(address))))
    from simdevice.sumo.junior_world import junior_world  # noqa: PLC0415 - as above

    return SharedTime(junior_world(junior_settings(address, _befalling(address), key)), prompt=True)
