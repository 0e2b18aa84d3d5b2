"""Who answers at the places where a robot may be, and why one can't be used. Nothing is moved, stopped or disarmed."""

from __future__ import annotations

import re
import threading
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from typing import TYPE_CHECKING, Final, Protocol, runtime_checkable

from firmware_protocol.address import parse_address
from firmware_protocol.errors import AddressError, HilError, LinkClosedError, LinkOpenError, LinkTimeoutError
from firmware_protocol.wire.fields import CAN, MAVLINK
from hil.bridge.clock import MonotonicClock
from hil.connecting.connecting import open_address, with_system
from hil.connecting.diagnosis import OTHER_ROBOT, Kind, Seen, judge
from hil.connecting.lines import pace_of
from hil.connecting.listening import HeardRobot, Listener, Signed
from hil.signing.key_file import open_signing

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from firmware_protocol.clock import Clock
    from firmware_protocol.link import Link
    from firmware_protocol.wire.signing import Signing, SigningKey
    from hil.connecting.diagnosis import Diagnosis
    from hil.connecting.places import Place

    Opener = Callable[[str], tuple[Link, Clock]]
    """Opens an address; gives the link and the clock it runs by."""

USUAL_RATES: Final = (115200, 57600, 9600, 38400, 19200, 230400, 460800, 921600, 500000, 1000000)
"""Rates to try where bytes come that are no MAVLink, in bit/s."""
_SLICE: Final = 0.05
"""Longest wait for bytes at a time, in s."""
_ENOUGH: Final = 32
"""Bytes after which noise is called noise."""
_DWELL: Final = 0.35
"""How long to listen at a rate that brings noise, in s."""
_ASK_ADAPTER: Final = 1.5
"""A serial port that has been silent for this long is asked whether it is a CAN adapter, in s."""
_ADAPTER_VERSION: Final = b"\r\rV\r"
"""The version question of the Lawicel protocol; noise to everybody else."""
_ADAPTER_ANSWER: Final = re.compile(rb"V[0-9A-Fa-f]{4}\r|CANable|CANtact|slcan", re.IGNORECASE)
_ADAPTER_FRAME: Final = re.compile(rb"(?:^|\r)[tT][0-9A-Fa-f]{4,29}\r")
_KEPT: Final = 256
"""Bytes kept to tell a CAN adapter by."""
_GONE: Final = "Plug it in again, or close the program that has it, and look once more"
_NEEDS_KEY: Final = "A robot that signs believes only who has its key: docs/signing.md"
_NOT_OUR_TIME: Final = "it signs with this key, at times that have been, and does not follow"
_GRACE: Final = 2.0
"""A port that has not been opened this long after the time-out is given up, in s."""


class Status(StrEnum):
    """What was found."""

    ROBOT = "robot"
    """At least one robot that we can speak to."""
    VEHICLE = "vehicle"
    """MAVLink, but no Junior we can speak to."""
    ADAPTER = "adapter"
    """A serial CAN adapter: the bus behind it has an address of its own."""
    NOISE = "noise"
    """Bytes come, but no MAVLink at any usual rate."""
    SILENT = "silent"
    """It could be opened, and nothing answers."""
    UNAVAILABLE = "unavailable"
    """It can't be opened."""
    NOT_PROBED = "not probed"
    """Nobody has looked."""


_STATUS: Final = {
    Kind.SILENCE: Status.SILENT,
    Kind.BUS: Status.SILENT,
    Kind.NOISE: Status.NOISE,
    Kind.TEXT: Status.NOISE,
    Kind.ECHO: Status.NOISE,
    Kind.TURNED_AWAY: Status.UNAVAILABLE,
}
"""What each diagnosis is to a script; all others are of somebody who speaks MAVLink."""


@dataclass(frozen=True)
class Finding:
    """What is at a place.

    Attributes:
        place: Which.
        status: What was found.
        url: What to connect to: that of the place, or with the rate at which a robot answered.
        robots: Who answers there.
        reason: In words; empty where the robots say it all.
        remedy: What to do next; may be empty.
    """

    place: Place
    status: Status
    url: str
    robots: tuple[HeardRobot, ...] = ()
    reason: str = ""
    remedy: str = ""

    def address(self, robot: HeardRobot) -> str:
        """What to connect to in order to reach one of the robots.

        Args:
            robot: Which.
        """
        if len(self.robots) < 2:
            return self.url
        return with_system(self.url, robot.system)


@runtime_checkable
class _HasRate(Protocol):
    """A link whose rate can be changed while it is open."""

    def set_baud(self, baud: int) -> None:
        """Listen at another rate."""
        ...


# --- Looking ---------------------------------------------------------------------------------------------------------


def open_url(url: str, key: SigningKey | None = None) -> tuple[Link, Clock]:
    """Open an address as `hil.connect` does.

    Args:
        url: The address.
        key: Signing key that an emulated robot in this process comes up with, where it can.

    Raises:
        LinkOpenError: It could not be opened.
    """
    address = parse_address(url)
    link, clock, _ = open_address(address, None if address.options.get("wire") == CAN else key)
    return link, clock


def probe(
    place: Place,
    timeout: float,
    opener: Opener = open_url,
    stopped: Callable[[], bool] = lambda: False,
    key: SigningKey | None = None,
) -> Finding:
    """Open a place, see who answers, and close it. Nothing is moved, disarmed or stopped.

    Args:
        place: Where.
        timeout: Longest look in s, in the link's time.
        opener: Opens it.
        stopped: Says whether to give up.
        key: Signing key to recognise robots by; on a CAN bus nothing is signed.

    Returns:
        What was found; never raises for what is found there.
    """
    if place.obstacle:
        return Finding(place, Status.UNAVAILABLE, place.url, reason=place.obstacle, remedy=place.remedy)
    try:
        link, clock = opener(place.url)
    except LinkOpenError as error:
        return Finding(place, Status.UNAVAILABLE, place.url, reason=error.reason, remedy=error.remedy)
    with link:
        try:
            signing = open_signing(key, link, clock) if link.wire == MAVLINK else None
            return _Look(place, link, clock, timeout, stopped, signing=signing).result()
        except TurnedAwayError as error:
            return Finding(place, Status.UNAVAILABLE, place.url, reason=error.diagnosis.reason, remedy=error.diagnosis.remedy)
        except HilError as error:
            reason = str(error).removeprefix(f"{place.url}: ")
            return Finding(place, Status.UNAVAILABLE, place.url, reason=reason, remedy=_GONE)


class TurnedAwayError(LinkClosedError):
    """The other end has said why it does not speak with us, and has closed the link.

    Attributes:
        diagnosis: In words.
    """

    def __init__(self, url: str, diagnosis: Diagnosis) -> None:
        super().__init__(url, str(diagnosis))
        self.diagnosis = diagnosis


class _Look:
    """One look at an open link."""

    def __init__(
        self,
        place: Place,
        link: Link,
        clock: Clock,
        timeout: float,
        stopped: Callable[[], bool],
        *,
        signing: Signing | None,
    ) -> None:
        self._place = place
        self._link = link
        self._now = clock.now
        self._end = clock.now() + timeout
        self._stopped = stopped
        self._signing = signing
        self._asked_adapter = False
        self._raw = b""

    def result(self) -> Finding:
        place = self._place
        listener = self._listen(self._end, noise_ends=True)
        rate = None
        if self._is_noise(listener) and not listener.witness.text and isinstance(self._link, _HasRate):
            first = parse_address(place.url).port_baud()[1]
            for other in (*(rate for rate in USUAL_RATES if rate != first), first):  # the noise may have been a start's
                if self._now() >= self._end or self._stopped():
                    break
                found = self._at(self._link, other)
                if found is not None:
                    listener, rate = found, other
                    break
        return self._finding(listener, rate)

    def _at(self, link: _HasRate, rate: int) -> Listener | None:
        """Listen at another rate; None where nothing sensible comes."""
        try:
            link.set_baud(rate)
        except LinkOpenError:  # the adapter can't do it
            return None
        listener = self._listen(min(self._end, self._now() + _DWELL), noise_ends=True)
        if not listener.witness.good and not listener.witness.mavlink:
            return None
        return self._listen(self._end, listener)

    def _listen(self, end: float, listener: Listener | None = None, *, noise_ends: bool = False) -> Listener:
        """Listen until everything is known, or the time is over, or what comes is plainly noise."""
        begun = self._now()
        if listener is None:
            listener = Listener(self._link.wire, begun, self._signing)
        while (now := self._now()) < end and not self._stopped():
            if out := listener.due(now):
                self._send(out)
            try:
                data = self._link.read(min(_SLICE, end - now))
            except LinkClosedError as error:
                if (told := listener.witness.told) and not listener.robots:  # nothing else was said: it is why
                    seen = Seen(self._place.url, listener.witness, self._link.wire, self._now(), farewell=told)
                    raise TurnedAwayError(self._place.url, judge(seen)) from error
                raise
            now = self._now()
            listener.take(data, now)
            self._raw = (self._raw + data)[-_KEPT:]
            if listener.settled(now) or self._is_adapter(listener):
                break
            if noise_ends and now >= begun + _DWELL and self._is_noise(listener) and not listener.witness.text:
                break
            if not listener.witness.received and now >= begun + _ASK_ADAPTER and not self._asked_adapter:
                self._ask_adapter()
        return listener

    def _send(self, data: bytes) -> None:
        try:
            self._link.write(data)
        except LinkTimeoutError:  # nobody takes it: then nobody answers either
            return

    def _ask_adapter(self) -> None:
        """Ask a silent serial port whether it is a CAN adapter."""
        self._asked_adapter = True
        if isinstance(self._link, _HasRate):
            self._send(_ADAPTER_VERSION)

    def _is_adapter(self, listener: Listener) -> bool:
        if not isinstance(self._link, _HasRate) or listener.witness.good:
            return False
        return bool(_ADAPTER_FRAME.search(self._raw) or (self._asked_adapter and _ADAPTER_ANSWER.search(self._raw)))

    def _is_noise(self, listener: Listener) -> bool:
        return (
            self._link.wire != CAN
            and listener.witness.received >= _ENOUGH
            and not listener.witness.good
            and not listener.witness.mavlink
        )

    def _finding(self, listener: Listener, rate: int | None) -> Finding:
        """Say what was heard."""
        robots, url = listener.robots, self._place.url
        if rate is not None:
            url = f"serial://{parse_address(url).port_baud()[0]}:{rate}"
        if any(robot.usable for robot in robots):
            signed = any(robot.usable and robot.signed is Signed.OUR_KEY for robot in robots)
            return Finding(self._place, Status.ROBOT, url, robots, *_too_slow(url, signed=signed))
        if robots:
            foreign = any(robot.signed in {Signed.OTHER_KEY, Signed.UNKNOWN_KEY} for robot in robots)
            return Finding(self._place, Status.VEHICLE, url, robots, remedy=_NEEDS_KEY if foreign else OTHER_ROBOT)
        status, reason, remedy = self._without_robots(listener, rate)
        return Finding(self._place, status, url, reason=reason, remedy=remedy)

    def _without_robots(self, listener: Listener, rate: int | None) -> tuple[Status, str, str]:
        """What there is instead of robots: status, reason, remedy."""
        if self._is_adapter(listener):
            bus = f"can://slcan/{parse_address(self._place.url).port_baud()[0]}?bitrate=500000"
            remedy = f"hil ports '{bus}' looks at the bus behind it, with your bus's bit rate"
            return Status.ADAPTER, "a serial CAN adapter", remedy
        if listener.behind:
            return Status.VEHICLE, _NOT_OUR_TIME, "Does it hear us? Is this computer's clock right?"
        swept = isinstance(self._link, _HasRate) and rate is None
        seen = Seen(self._place.url, listener.witness, self._link.wire, self._now(), swept=swept)
        diagnosis = judge(seen)
        return _STATUS.get(diagnosis.kind, Status.VEHICLE), diagnosis.reason, diagnosis.remedy


def _too_slow(url: str, *, signed: bool) -> tuple[str, str]:
    """What is said of a robot on a line on which it can't be driven: reason and remedy; empty where it can."""
    try:
        pace_of(parse_address(url), signed=signed)
    except AddressError:
        pass
    except LinkOpenError as error:
        return error.reason, error.remedy
    return "", ""


def survey(
    places: Sequence[Place],
    timeout: float,
    opener: Opener | None = None,
    *,
    grace: float = _GRACE,
    key: SigningKey | None = None,
) -> list[Finding]:
    """Look at all places at once.

    Args:
        places: Where.
        timeout: Longest look at each, in s.
        opener: Opens them; None is `open_url`.
        grace: How much longer to wait for a place whose opening hangs, in s.
        key: Signing key to recognise robots by.

    Returns:
        What was found, in the order of the places, after at most `timeout` and `grace`.
    """
    stop = threading.Event()
    findings: list[Finding | None] = [None] * len(places)
    opens = opener or partial(open_url, key=key)

    def look(index: int) -> None:
        findings[index] = probe(places[index], timeout, opens, stop.is_set, key)

    threads = [
        threading.Thread(target=look, args=(index,), daemon=True, name=f"probe {place.url}")
        for index, place in enumerate(places)
    ]
    clock = MonotonicClock()
    try:
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(max(0.0, timeout + grace - clock.now()))
    finally:
        stop.set()
    return [finding or _stuck(place) for place, finding in zip(places, findings, strict=True)]


def _stuck(place: Place) -> Finding:
    return Finding(
        place,
        Status.UNAVAILABLE,
        place.url,
        reason="opening it takes too long",
        remedy="Unplug it, plug it in again, and look once more",
    )
