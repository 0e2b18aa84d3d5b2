"""A log of what passes between an emulated robot and whoever speaks with it, taken down beside the robot.

For programs with a MAVLink stack of their own: no bridge of ours sees what they say.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.events import Received
from firmware_protocol.messages import HOST_COMPONENT, HOST_SYSTEM, ROBOT_COMPONENT
from firmware_protocol.wire.codec import open_codec
from hil.signing.redaction import Redaction

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.events import Rejected
    from firmware_protocol.links.memory import Stamped
    from hil.recording.wire_log import WireLog
    from simdevice.emulation import Emulation


class LineLog:
    """Writes down what an emulation and its host say to each other, with the emulation's time.

    It watches `run` and `step` of that one emulation, and changes nothing. Of signing keys it writes zeros, as the bridge does.
    There are no steps in such a log, since there is no bridge: it can be looked at, and not be replayed.

    Args:
        emulation: What is watched.
        log: Is written to, and closed by whoever made it.
    """

    def __init__(self, emulation: Emulation, log: WireLog) -> None:
        self._log = log
        self._emulation = emulation
        self._run, self._step = emulation.run, emulation.step
        self._inside = False
        self._said = OneWay(emulation.wire, HOST_SYSTEM, HOST_COMPONENT, log.wire_rx, log.received)
        self._told = OneWay(emulation.wire, 1, ROBOT_COMPONENT, log.wire_tx, self._sent)
        for name, watched in (("run", self.run), ("step", self.step)):
            setattr(emulation, name, watched)

    def run(self, inbound: bytes, periods: int) -> list[Stamped]:
        """See `Emulation.run`."""
        if self._inside:  # one of the two may be made of the other
            return self._run(inbound, periods)
        self._inside = True
        try:
            self._hear(inbound)
            said = self._run(inbound, periods)
        finally:
            self._inside = False
        for stamp, data in said:
            self._said.passes(stamp, data)
        return said

    def step(self, inbound: bytes) -> bytes:
        """See `Emulation.step`."""
        if self._inside:
            return self._step(inbound)
        self._inside = True
        try:
            self._hear(inbound)
            said = self._step(inbound)
        finally:
            self._inside = False
        if said:
            self._said.passes(self._emulation.now(), said)
        return said

    def end(self) -> None:
        """Watch no longer, and write down what is still held."""
        for name, own in (("run", self._run), ("step", self._step)):
            setattr(self._emulation, name, own)
        for way in (self._told, self._said):
            way.end(self._emulation.now())

    def _hear(self, inbound: bytes) -> None:
        self._log.now = self._emulation.now()
        if inbound:
            self._told.passes(self._log.now, inbound)

    def _sent(self, event: Received | Rejected) -> None:
        """Write down what the host has said; the stack of somebody else may say what we don't understand."""
        if isinstance(event, Received):
            self._log.sent(event.time, event.message)
        else:
            self._log.received(event)


class OneWay:
    """One way of the line.

    Args:
        wire: What goes over it.
        system: System id of who listens there.
        component: Its component id.
        write: Takes the bytes that may be written down, with their stamp in s.
        tell: Takes what they say.
    """

    def __init__(
        self,
        wire: str,
        system: int,
        component: int,
        write: Callable[[float, bytes], None],
        tell: Callable[[Received | Rejected], None],
    ) -> None:
        self._codec = open_codec(wire, system=system, component=component)
        self._redaction = Redaction(wire)
        self._write = write
        self._tell = tell

    def passes(self, time: float, data: bytes) -> None:
        """Bytes go by.

        Args:
            time: When, in s.
            data: The bytes.
        """
        events = self._codec.receive(data, time)
        for chunk in self._redaction.received(time, data, events):
            self._write(*chunk)
        for event in events:
            self._tell(event)

    def end(self, time: float) -> None:
        """Nothing comes any more.

        Args:
            time: Since when, in s.
        """
        events = self._codec.flush(time, ended=True)
        for chunk in self._redaction.ended(events):
            self._write(*chunk)
        for event in events:
            self._tell(event)
