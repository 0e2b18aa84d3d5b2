"""What everything emulated offers to links, servers and tests, whatever lives in it: the one contract.

    World           Junior, its opponent and the referee, in Python: the readable one, and the oracle of the others
     └── KernelWorld    the same with whole control periods in C
    Crowd           several of them on one line
    DisturbedWorld  any of them behind a bad line

Time passes only in `run` and `step`, in control periods; nothing in it knows another clock. What happens depends on the seeds
and on what comes in, in which period, and on nothing else.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    from firmware_protocol.links.memory import Stamped, Steppable


class Emulation(Protocol):
    """Something emulated: robots, the place they are in, and a line to them.

    A `firmware_protocol.links.memory.Steppable` says what of this a link needs.

    Attributes:
        wire: What goes in and out: MAVLink, or CAN frames in serial form.
        period: One control period, in s.
    """

    wire: str
    period: float

    def now(self) -> float:
        """Time of the emulation in s: that of the control period that begins next."""
        ...

    def run(self, inbound: bytes, periods: int) -> list[Stamped]:
        """Live for at most so many control periods.

        It returns early when something is sent, decided, rebooted, or due: a referee's word, a fault's next change, the
        delivery of a faulty line. How long it has lived `now` tells. So it may return with nothing sent before the time is
        over; who waits asks again.

        Args:
            inbound: Bytes from the host that have arrived by now; they are received in the first of the periods.
            periods: How many, 1 or more.

        Returns:
            What has been sent to the host, each with the end of the period it was sent in, in s; mostly one or none.

        Raises:
            ValueError: It is asked for no period at all.
        """
        ...

    def step(self, inbound: bytes) -> bytes:
        """Live for one control period: `run(inbound, 1)` without the stamps.

        Args:
            inbound: Bytes from the host that have arrived by now.

        Returns:
            Everything sent to the host in this period.
        """
        ...


class Powered(Emulation, Protocol):
    """One robot, whose power can be cut."""

    @property
    def nvm(self) -> bytes:
        """Image of the EEPROM."""
        ...

    def switch_off(self) -> None:
        """Cut its power: its wheels are off and nothing is heard of it; the world goes on, and the EEPROM is kept."""
        ...

    def switch_on(self) -> None:
        """Give it its power back, if it has none: it boots."""
        ...


@runtime_checkable
class Patient(Protocol):
    """What says no more than its line takes.

    Attributes:
        room: Bytes that its line takes in the next control period; None: any number.
    """

    room: int | None


def check_periods(periods: int) -> None:
    """See that control periods can be lived for.

    Args:
        periods: How many.

    Raises:
        ValueError: There are none.
    """
    if periods < 1:
        raise ValueError(f"one lives for 1 or more control periods, not {periods}")


def run_single_periods(emulation: Steppable, inbound: bytes, periods: int) -> list[Stamped]:
    """What `Emulation.run` does, for what can live for one control period at a time only.

    Args:
        emulation: What is to live.
        inbound: Bytes from the host that have arrived by now.
        periods: How many control periods, 1 or more.

    Returns:
        What has been sent, and when, in s.

    Raises:
        ValueError: It is asked for no period at all.
    """
    check_periods(periods)
    for _ in range(periods):
        if sent := emulation.step(inbound):
            return [(emulation.now(), sent)]
        inbound = b""
    return []
