"""From an address to a robot: the one place where an emulated robot and a physical one part ways."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.address import Address, parse_address
from firmware_protocol.codec import SPLITTERS
from firmware_protocol.errors import AddressError, FaultSpecError
from firmware_protocol.link import Link, open_link
from firmware_protocol.links.faulty import FaultyLink
from firmware_protocol.wire import MAVLINK
from hil.bridge import Bridge, Tap, random_session
from hil.clock import MonotonicClock
from hil.fault_file import read_faults
from hil.junior import Junior
from hil.safety import Limits
from hil.seeds import Branch, generator

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from firmware_protocol.clock import Clock
    from firmware_protocol.faults import FaultSpec

DEFAULT_URL = "sim://junior"
SIM_OPTIONS = ("opponent", "seed", "faults", "referee", "wire", "system", "node")


def connect(
    url: str = DEFAULT_URL,
    *,
    system: int | None = None,
    timeout: float = 5.0,
    limits: Limits = Limits(),  # noqa: B008 - frozen
    taps: Sequence[Tap] = (),
) -> Junior:
    """Connect to a robot and do the handshake. The robot is stopped and disarmed by that.

    Args:
        url: `serial:///dev/ttyACM0:115200`, `tcp://127.0.0.1:5760`, `udpin://127.0.0.1:14550`, or an emulated robot in this
            process, in lock-step: `sim://junior?opponent=flat-light&seed=1`. `?system=` selects one of several robots, and
            `?faults=drop:0.05,corrupt:0.01,jitter:0.02` rehearses a bad line; with an emulated robot
            `?faults=stuck:eye_left@5+3,brownout:20` a bad robot too, and `?faults=@FILE.toml` what a file says.
        system: System id of the robot; None takes the first that answers.
        timeout: Longest wait for it in s.
        limits: Bounds on what is asked of it.
        taps: What is shown everything that passes: a `Recorder`, for instance.

    Returns:
        The robot; use it in a `with` block, which stops the robot on every way out.

    Raises:
        AddressError: The URL is no address we know.
        LinkOpenError: The link could not be opened; the text says what to do.
        NoRobotError: Nobody answered as a robot.
        VersionError: It speaks a protocol we do not.
    """
    address = parse_address(url)
    link, clock, session = open_address(address)
    if system is None:
        system = number_option(address, "node" if "node" in address.options else "system")
    robots = None if system is None else [system]
    junior = Junior(Bridge(link, clock, taps=taps, robots=robots, session=session), clock.now, limits)
    try:
        junior.find(system, timeout)
    except BaseException:
        junior.close()
        raise
    return junior


def open_address(address: Address) -> tuple[Link, Clock, Callable[[], int]]:
    """Open what an address names.

    Args:
        address: The address, taken apart.

    Returns:
        The link, the clock it runs by, and a source of session numbers.

    Raises:
        AddressError: The URL is no address we know.
        LinkOpenError: The link could not be opened.
    """
    seed = number_option(address, "seed") or 0
    faults = fault_option(address)
    if address.scheme == "sim":
        link, clock = _emulated(address, seed, faults)
        numbers = generator(seed, Branch.SESSION)

        def session() -> int:
            return int(numbers.integers(1, 0x10000))

    else:
        clock = MonotonicClock()
        bare, _, options = address.url.partition("?")
        kept = "&".join(option for option in options.split("&") if option and not option.startswith(("faults=", "seed=")))
        link = open_link(f"{bare}?{kept}" if kept else bare)
        session = random_session
    if faults is not None:
        link = FaultyLink(link, faults, seed=seed, clock=clock, split=SPLITTERS[link.wire])
    return link, clock, session


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
            "Give it to `hil emulate --faults`",
        )
    return spec


def _emulated(address: Address, seed: int, faults: FaultSpec | None) -> tuple[Link, Clock]:
    """An emulated robot in this process, in lock-step."""
    from firmware_protocol.links.memory import MemoryLink  # noqa: PLC0415 - pymunk is only needed here
    from simdevice.world import junior_world  # noqa: PLC0415

    address.only(*SIM_OPTIONS)
    if address.target != "junior":
        raise AddressError(address.url, f"there is no emulated {address.target!r}", "Write sim://junior")
    referee = address.options.get("referee", "1")
    if referee not in {"0", "1"}:
        raise AddressError(address.url, "referee is 0 or 1")
    wire = address.options.get("wire", MAVLINK)
    if wire not in SPLITTERS:
        raise AddressError(address.url, f"wire is {' or '.join(SPLITTERS)}")
    try:
        world = junior_world(
            opponent=address.options.get("opponent", "flat-light"),
            seed=seed,
            referee=referee == "1",
            wire=wire,
            faults=faults,
        )
    except ValueError as error:
        raise AddressError(address.url, str(error)) from error
    return MemoryLink(world, address.url, wire=wire), world


def number_option(address: Address, name: str) -> int | None:
    """A whole number among the options of an address.

    Args:
        address: The address, taken apart.
        name: Which option.

    Returns:
        Its value; None where it is not given.

    Raises:
        AddressError: It is no whole number.
    """
    text = address.options.get(name)
    if text is None:
        return None
    if not text.isascii() or not text.isdigit() or int(text) >= 2**32:
        raise AddressError(address.url, f"{name} is a whole number, not {text!r}")
    return int(text)
