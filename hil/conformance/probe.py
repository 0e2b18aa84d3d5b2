"""Our end of the wire: it says what it is told to and nothing else, and remembers all it hears.

No peer and no bridge: a check must be able to be silent, to repeat itself, and to send what no good host would. Only the
messages that keep an armed robot moving go out by themselves, and `silence` turns these off.
"""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Final, Protocol, TypeVar

from firmware_protocol.errors import EncodeError, LinkClosedError, LinkError, NoRobotError, PeerLostError
from firmware_protocol.events import Received, Rejected
from firmware_protocol.messages import (
    GROUND_STATION,
    HOST_COMPONENT,
    HOST_SYSTEM,
    ROBOT_COMPONENT,
    TABLE_COMPONENT,
    Heartbeat,
    RobotAlive,
)
from firmware_protocol.peer.timing import HEARTBEAT_PERIOD, HOST_HEARTBEAT, KEEP_ALIVE
from firmware_protocol.roles.swarm_table import table_system
from firmware_protocol.wire.can.dbc import CanCodec
from firmware_protocol.wire.can.frame import pack_frames
from firmware_protocol.wire.codec import open_codec
from firmware_protocol.wire.fields import CAN, MAVLINK
from firmware_protocol.wire.mavlink import MavlinkCodec
from firmware_protocol.wire.mavlink_layout import FLAG_SIGNED
from firmware_protocol.wire.signing import trouble
from hil.bridge.clock import LastReading
from hil.bridge.operator import INTERRUPT, Operator
from hil.bridge.pump import open_pump
from hil.bridge.surroundings import Surroundings
from hil.bridge.taps import Opening
from hil.bridge.witness import EVERYBODY, Witness
from hil.conformance import can_frames, frames
from hil.conformance.registry import NotRunError
from hil.connecting.diagnosis import Seen, nobody
from hil.signing.redaction import Redaction

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence

    from firmware_protocol.clock import Clock
    from firmware_protocol.link import Link
    from firmware_protocol.wire.can.frame import CanFrame
    from firmware_protocol.wire.fields import Message
    from firmware_protocol.wire.signing import Signing
    from hil.bridge.pump import Chunk, Pump
    from hil.bridge.taps import Tap

M = TypeVar("M", bound="Message")

PATIENCE: Final = 0.5
"""How long an answer may take before it is asked for again, in s."""
QUIET: Final = 0.1
"""How long to listen for an answer that must not come, in s."""
TRIES: Final = 4
"""How often something is asked that is not answered."""
LOST_AFTER: Final = 5.0
"""A robot that has said nothing for so long is gone, in s."""
_HEARTBEATS: Final = round(HEARTBEAT_PERIOD / KEEP_ALIVE)
"""Every so many ROBOT_ALIVE we send a HEARTBEAT as well."""
HOST: Final = (HOST_SYSTEM, HOST_COMPONENT)
"""Our own address."""


class Translator(Protocol):
    """What makes wire data of messages, and back."""

    def encode(self, message: Message) -> bytes:
        """The wire data of a message."""
        ...

    def receive(self, data: bytes, now: float) -> list[Received | Rejected]:
        """What a chunk of wire data holds."""
        ...


class Probe:
    """One link, one robot.

    Args:
        link: An open link; closed with the probe.
        clock: Tells the time.
        host: Our number, 1..65535: by it the robot knows who keeps it moving.
        system: System id of the robot; None takes the first that is heard.
        codec: Speaks the link's language; None is that of the link's wire.
        taps: What sees everything.
        signing: Signs what is sent, where nothing else speaks the link's language.
        pump: Hands over what the link brings; None makes the one that suits it.
        operator: Whose signals are taken in by the steps; None: nobody's.
        network: Name of the network; None is the address of the link.

    Attributes:
        host: Our number.
        system: System id of the robot; 0 while none has been heard.
        others: System ids of other robots that were heard.
        wire: What the link carries: `mavlink` or `can`.
        second: System id of a robot beside it that is listened to as well; None: none.
        table: The table of emulated micro-robots has been heard.
        heard: Everything the robot has said since `forget`, in order.
        beside: Everything the second robot and the table have said since then.
        rejected: What came that was no good message, since `forget`.
        spoilt: Pieces of wire input that were no good message, in all.
        lost: Frames of the robot that did not arrive, by their numbers, in all.
    """

    def __init__(
        self,
        link: Link,
        clock: Clock,
        *,
        host: int,
        system: int | None = None,
        codec: Translator | None = None,
        taps: Sequence[Tap] = (),
        signing: Signing | None = None,
        pump: Pump | None = None,
        operator: Operator | None = None,
        network: str | None = None,
    ) -> None:
        self.host = host
        self.system = system or 0
        self.others: set[int] = set()
        self.wire = link.wire
        self.second: int | None = None
        self.table = False
        self.heard: list[Received] = []
        self.beside: list[Received] = []
        self.rejected: list[Rejected] = []
        self.spoilt = 0
        self.lost = 0
        reading = clock if isinstance(clock, LastReading) else LastReading(clock)
        self.now = reading.now
        self._read_clock = reading.read
        self._link = link
        ours = open_codec(link.wire, system=HOST_SYSTEM, component=HOST_COMPONENT, signing=signing if codec is None else None)
        self._codec: Translator = codec or ours
        self._judge = ours
        self._redaction = Redaction(link.wire)
        self.signing = signing
        self._clients: dict[tuple[int, int], Translator] = {}
        self._taps = tuple(taps)
        self._alive = True
        self._alive_due = self.now()
        self._alive_sent = 0
        self._last = self.now()
        self._witness = Witness(HOST_SYSTEM, self.now())
        self._next: int | None = None
        signed = 0 if signing is None else signing.clock()
        for tap in self._taps:
            tap.opened(Opening(network or link.url, link.url, link.wire, link.lockstep, self.now(), signed))
            tap.session_drawn(host)
        self._pump = open_pump(link, clock) if pump is None else pump
        self._operator = operator or Operator()
        self._around = Surroundings(self._operator, self._pump)
        self._operator.attach(self._pump.wake)

    def close(self) -> None:
        """Close the link."""
        self._operator.detach(self._pump.wake)
        self._pump.close()
        self._link.close()
        self._pass(self._redaction.ended(self._judge.flush(self.now(), ended=True)))

    # --- speaking ----------------------------------------------------------------------------------------------------

    def send(self, *messages: Message) -> None:
        """Send messages, in one piece.

        Raises:
            LinkError: The link is gone.
            NotRunError: The link's wire has no place for one of them, as CAN for a component of another number.
        """
        try:
            data = b"".join(self._codec.encode(message) for message in messages)
        except EncodeError as error:
            if isinstance(self._codec, MavlinkCodec):
                raise
            raise NotRunError(str(error)) from error
        self.raw(data)
        for tap in self._taps:
            for message in messages:
                tap.sent(self.now(), message)

    def need_sources(self) -> None:
        """See that a frame says who sent it.

        Raises:
            NotRunError: The link carries CAN frames, and these do not.
        """
        if self.wire == CAN:
            raise NotRunError("a bus has no source")

    def need_own_line(self) -> None:
        """See that a frame that is no good one reaches the robot.

        Raises:
            NotRunError: It is one of several of an emulated table, which get good frames only.
        """
        if self.table and (self.others or self.second is not None):
            raise NotRunError("several robots of an emulated table share the line, and get good frames only")

    @property
    def strangers(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """Addresses, system and component, that other programs may have: in our system, and in one that nobody has."""
        taken = {self.system, HOST_SYSTEM, *self.others}
        return (HOST_SYSTEM, ROBOT_COMPONENT), (max(set(range(1, HOST_SYSTEM)) - taken), HOST_COMPONENT)

    def send_as(self, who: tuple[int, int], *messages: Message) -> None:
        """Send messages as another program of the network does, in one piece.

        Args:
            who: System and component of its frames; our own are sent as ever.
            *messages: What it says.

        Raises:
            LinkError: The link is gone.
            NotRunError: The link carries CAN frames.
        """
        if who == HOST:
            self.send(*messages)
            return
        self.need_sources()
        if who not in self._clients:  # its frames are numbered for themselves
            self._clients[who] = open_codec(MAVLINK, system=who[0], component=who[1], signing=self.signing)
        self.raw(b"".join(self._clients[who].encode(message) for message in messages))

    def frame(self, message: Message) -> bytes:
        """The bytes of a message, not sent.

        Raises:
            NotRunError: The link does not carry MAVLink bytes.
        """
        if not isinstance(self._codec, MavlinkCodec):
            raise NotRunError("only on links that carry MAVLink bytes")
        return self._codec.encode(message)

    def frames(self, message: Message) -> list[CanFrame]:
        """The CAN frames of a message, not sent; a transfer takes the next number.

        Raises:
            NotRunError: The link does not carry CAN frames.
        """
        if not isinstance(self._codec, CanCodec):
            raise NotRunError("only on links that carry CAN frames")
        return self._codec.encode_frames(message)

    def forged(self, message: Message, name: str, value: float, index: int = 0) -> bytes:
        """The wire data of a message with a value that no codec of ours would send, with a good checksum; not sent.

        Args:
            message: A good message.
            name: The field.
            value: Its new value as it stands on the wire: an integer in wire units, or a float for `f32`.
            index: Which element, where the field has several.
        """
        if isinstance(self._codec, CanCodec):
            return pack_frames(can_frames.forged(self.frames(message), message, name, value, index))
        return self.sealed(frames.forged(self.frame(message), type(message), name, value, index))

    def put(self, *sent: CanFrame) -> None:
        """Send CAN frames as they are, in one piece.

        Raises:
            LinkError: The link is gone.
        """
        self.raw(pack_frames(sent))

    def sealed(self, frame: bytes) -> bytes:
        """A frame that was made by hand, signed where the link's frames are.

        Args:
            frame: Whole, without a signature; its flag for signed frames says whether it is to have one.
        """
        return frame + self.signing.sign(frame) if self.signing is not None and frame[2] & FLAG_SIGNED else frame

    def raw(self, data: bytes) -> None:
        """Send wire data as it is.

        Raises:
            LinkError: The link is gone.
        """
        try:
            self._link.write(data)
        except LinkError as error:
            for tap in self._taps:
                tap.unsent(self.now(), data, error)
            raise
        self._witness.sent(data)
        for tap in self._taps:
            tap.wire_tx(self.now(), data)

    @contextmanager
    def silence(self) -> Iterator[None]:
        """Inside, nothing goes out by itself."""
        before = self._alive
        self._alive = False
        try:
            yield
        finally:
            self._alive = before

    # --- listening ---------------------------------------------------------------------------------------------------

    def step(self, wait: float) -> None:
        """Wait for bytes and take them in.

        Args:
            wait: Longest wait, in s.

        Raises:
            LinkError: The link is gone.
            PeerLostError: The robot has been silent for too long.
            KeyboardInterrupt: The operator asked for it.
        """
        now = self.now()
        if self._alive and now >= self._alive_due:
            self._alive_due = now + KEEP_ALIVE
            self.send(RobotAlive(self.host), *([HOST_HEARTBEAT] if self._alive_sent % _HEARTBEATS == 0 else []))
            self._alive_sent += 1
        chunks = self._pump.take(0.0 if self._operator.waiting else wait, self._alive_due if self._alive else float("inf"))
        now = self._read_clock()
        met = self._around.look(self._link)
        for tap in self._taps:
            tap.step(now, chunks, met)
        for stamp, data in chunks:
            self._witness.came(data, stamp)
            found = self._codec.receive(data, stamp)
            judged = found if self._codec is self._judge else self._judge.receive(data, stamp)
            self._pass(self._redaction.received(stamp, data, judged))
            for event in found:
                self._take(event)
        if any(one.what == INTERRUPT for one in met.inputs):
            raise KeyboardInterrupt
        if not chunks and met.ended is not None:
            raise met.ended
        if self.system and now - self._last > LOST_AFTER:
            raise PeerLostError(f"{self._link.url}: the robot has been silent for {LOST_AFTER:g} s")

    def _pass(self, chunks: Sequence[Chunk]) -> None:
        """Tell the taps of bytes that came."""
        for stamp, data in chunks:
            for tap in self._taps:
                tap.wire_rx(stamp, data)

    def _take(self, event: Received | Rejected) -> None:
        for tap in self._taps:
            tap.received(event)
        self._witness.saw(event)
        if isinstance(event, Rejected):
            self.rejected.append(event)
            self.spoilt += 1
            return
        if not self.system and isinstance(event.message, Heartbeat) and event.message.type != GROUND_STATION:
            if event.component != ROBOT_COMPONENT or event.system in {EVERYBODY, HOST_SYSTEM}:
                return
            self.system = event.system
        if self.system and event.system not in {0, self.system, HOST_SYSTEM} and event.component == ROBOT_COMPONENT:
            self.others.add(event.system)
        of_table = (event.system, event.component) == (table_system(self.wire), TABLE_COMPONENT)
        self.table |= of_table
        if of_table or (event.system == self.second and event.component == ROBOT_COMPONENT):
            self.beside.append(event)
        if event.system == self.system and event.component == ROBOT_COMPONENT:
            self.heard.append(event)
            self._last = event.time
            gap = 0 if self._next is None else (event.sequence - self._next) % 256
            if gap < 128:  # more is one that comes late, or again
                self.lost += gap
                self._next = event.sequence + 1

    def spend(self, seconds: float) -> None:
        """Listen for a while.

        Args:
            seconds: How long.
        """
        end = self.now() + seconds
        while (left := end - self.now()) > 1e-9:  # sums of control periods are not exact
            self.step(left)

    def forget(self) -> None:
        """Forget what was heard."""
        self.heard.clear()
        self.beside.clear()
        self.rejected.clear()

    def got(self, kind: type[M], start: int = 0) -> list[M]:
        """What was heard of one kind.

        Args:
            kind: A message class.
            start: Index in `heard` to begin at.
        """
        return [event.message for event in self.heard[start:] if isinstance(event.message, kind)]

    def wait(
        self, kind: type[M], match: Callable[[M], bool] = lambda _: True, *, timeout: float = PATIENCE, start: int | None = None
    ) -> M | None:
        """Wait for a message.

        Args:
            kind: A message class.
            match: What else it must be.
            timeout: Longest wait, in s.
            start: Index in `heard` to begin at; None is what is yet to come.

        Returns:
            The first that matches; None where none came.
        """
        at = len(self.heard) if start is None else start
        end = self.now() + timeout
        while True:
            for event in self.heard[at:]:
                if isinstance(event.message, kind) and match(event.message):
                    return event.message
            at = len(self.heard)
            left = end - self.now()
            if left <= 1e-9:
                return None
            self.step(left)

    def ask(
        self,
        message: Message,
        kind: type[M],
        match: Callable[[M], bool] = lambda _: True,
        *,
        timeout: float = PATIENCE,
        tries: int = TRIES,
    ) -> M | None:
        """Send a message until it is answered.

        Args:
            message: What to send; it must be safe to repeat.
            kind: What the answer is.
            match: What else it must be.
            timeout: How long to wait for it each time, in s.
            tries: How often to send it.

        Returns:
            The answer; None where none came.
        """
        start = len(self.heard)
        for _ in range(tries):
            self.send(message)
            answer = self.wait(kind, match, timeout=timeout, start=start)
            if answer is not None:
                return answer
        return None

    def seen(self, *, wanted: int | None = None, unusable: Collection[int] = (), farewell: str = "") -> Seen:
        """What there is to judge by why no robot can be checked.

        Args:
            wanted: System id of the robot that was asked for; None for any.
            unusable: Systems that were found to be no Juniors.
            farewell: What was said at the other end when the link ended.
        """
        codec = self._codec
        return Seen(
            url=self._link.url,
            witness=self._witness,
            wire=self.wire,
            now=self.now(),
            wanted=wanted,
            unusable=unusable,
            key=trouble(codec.rejected, codec.signed, self.signing) if isinstance(codec, MavlinkCodec) else "",
            farewell=farewell,
        )

    def find(self, timeout: float) -> None:
        """Wait for a robot.

        Args:
            timeout: Longest wait, in s.

        Raises:
            NoRobotError: None was heard.
            LinkError: The link is gone.
        """
        end = self.now() + timeout
        wanted = self.system or None
        try:
            while not self.heard and (left := end - self.now()) > 0:
                self.step(left)
        except LinkClosedError as error:
            if self._witness.told:
                raise NoRobotError(nobody(self.seen(wanted=wanted, farewell=self._witness.told), timeout)) from error
            raise
        if not self.heard:
            raise NoRobotError(nobody(self.seen(wanted=wanted), timeout))
