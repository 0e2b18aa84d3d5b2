"""The bridge's tap that writes the log: steps, bytes, messages and events of any network. Nothing else writes logs."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Final, Self

import numpy as np

from firmware_protocol.errors import LinkTimeoutError, bare_text
from firmware_protocol.events import (
    Event,
    LinkNews,
    PeerBack,
    PeerFound,
    PeerLost,
    Received,
    Rejected,
    StreamBack,
    StreamStopped,
)
from firmware_protocol.faults.failures import FailureType, failure_in_words
from firmware_protocol.messages import (
    HOST_COMPONENT,
    HOST_SYSTEM,
    MESSAGES,
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    RobotSession,
    SetupSigning,
    Statustext,
)
from firmware_protocol.wire.rows import messages_of
from hil.bridge.taps import NOTHING
from hil.mcaplog.records import (
    EVENTS,
    BridgeOpening,
    BridgeStep,
    EventRecord,
    RejectedInput,
    SessionDrawn,
    UnsentBytes,
    WireBytes,
)
from hil.mcaplog.schemas import message_schema, record_schema
from hil.mcaplog.writing.drawing import TEXT, encode_text
from hil.mcaplog.writing.encode import Encoder, compile_encoder, sender_suffix, step_encoder, wire_encoder
from hil.mcaplog.writing.row_encoding import EntryRows, encodable, encode_rows
from hil.mcaplog.writing.writer import CONFIG, LogWriter
from hil.recording.drawing import NoDrawing

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path
    from types import TracebackType

    from firmware_protocol.errors import LinkError
    from firmware_protocol.wire.batch import Arrivals, Batch
    from firmware_protocol.wire.fields import Message
    from firmware_protocol.wire.rows import Rows
    from hil.bridge.taps import Circumstances, Opening, Tap
    from hil.mcaplog.writing.sink import LogSink
    from hil.recording.drawing import Drawing

FLUSH: Final = 0.25
"""Log time between flushes, in s: what a crash may lose."""
SEVERITIES: Final = {"emergency": 0, "safety": 4, "error": 3, "warning": 4}
"""MAV_SEVERITY of a note by its kind; 6, information, for any other."""


MANY: Final = 12
"""Fewer messages than this are done sooner one by one; so are more, where every so many have another kind between them."""
LOOKED_INTO: Final = frozenset({CommandAck, CommandLong, RobotSession, SetupSigning, Statustext})
"""Messages of which more comes than their entries: they are done one by one."""


IN_ROWS: Final = frozenset(kind for kind in MESSAGES.values() if encodable(kind)) - LOOKED_INTO
"""Messages that can be written many at once."""


class WireLog:
    """Writes everything that passes the bridge into a log, whatever robots are there.

    What passes is recorded as the bridge tells it: of signing keys it tells nothing but zeros.

    Log times are the bridge's clock readings and the stamps of received chunks. A failure to write raises once; from then
    on the recorder is silent, so that the robot can be stopped through the same bridge.

    Args:
        path: The log file.
        run: Whatever differs between two runs of the same seed: wall clock, command line, paths.
        config: Program version, protocol version, seed, configuration; as text.
        link: Name of the network: the address of its link. Of several, that of the first.
        lockstep: The link is in lock-step.
        system: MAVLink system id of the host.
        component: MAVLink component id of the host.
        overwrite: A file that exists is replaced, when the log is whole.
        on_failure: Is told, in words, when the disk does not take any more, and which file holds what there is of the log
            (None: no file does); the run goes on without a log.
        writer: Takes the entries; None writes them to `path`.

    Attributes:
        now: Log time of what is noted, in s: the last step's reading of the clock.

    Raises:
        OutputExistsError: There is a file already, and it may not be replaced.
        LogError: The file cannot be created.
    """

    def __init__(
        self,
        path: Path,
        *,
        run: Mapping[str, str],
        config: Mapping[str, str],
        link: str,
        lockstep: bool,
        system: int = HOST_SYSTEM,
        component: int = HOST_COMPONENT,
        overwrite: bool = False,
        on_failure: Callable[[str, Path | None], None] | None = None,
        writer: LogSink | None = None,
    ) -> None:
        self.path = path
        self._writer: LogSink = writer or LogWriter(
            path,
            run=run,
            flush_every=FLUSH,
            long_chunks=lockstep,
            overwrite=overwrite,
            on_failure=on_failure,
        )
        self._writer.metadata(CONFIG, config)
        self.now = 0.0
        self._network = Network(self._writer, link)
        self._sender = system, component
        self._host = sender_suffix(system, component)
        self._messages: dict[type[Message], tuple[int, Encoder]] = {}
        self._records: dict[str, tuple[int, Encoder]] = {}
        self._drawing = self._make_drawing()
        self._failures: dict[int, CommandLong] = {}

    def _make_drawing(self) -> Drawing:
        """What makes pictures of what is heard and said: none, of a robot of no known role."""
        return NoDrawing()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    # --- the bridge's tap --------------------------------------------------------------------------------------------

    def of_network(self, name: str) -> Tap:
        """What records one of several networks, into the same log.

        Args:
            name: Its name.
        """
        return OneOfSeveral(self, Network(self._writer, name))

    def opened(self, opening: Opening) -> None:
        """The bridge begins."""
        self.now = opening.clock
        self.record("/bridge/open", opening, self.now, BridgeOpening)

    def session_drawn(self, number: int) -> None:
        """A number was drawn by chance."""
        self.number_drawn(self._network.name, number)

    def number_drawn(self, network: str, number: int) -> None:
        """A number was drawn by chance, on one of several networks.

        Args:
            network: Its name.
            number: The number.
        """
        self.record("/bridge/session", SessionDrawn(network, number), self.now)

    def step(self, time: float, chunks: Sequence[tuple[float, bytes]], met: Circumstances = NOTHING) -> None:
        """The bridge has begun a step.

        Args:
            time: Its one reading of the clock, in s.
            chunks: What it received since the step before: stamps in s, bytes.
            met: What else it has met.
        """
        self.now = time
        self._network.step(time, chunks, met)

    def wire_rx(self, time: float, data: bytes) -> None:
        """Bytes came over the link; time is their stamp, in s."""
        self._network.wire_rx(time, data)

    def wire_tx(self, time: float, data: bytes) -> None:
        """Bytes went out over the link; time is the bridge's, in s."""
        self._network.wire_tx(time, data)

    def unsent(self, time: float, data: bytes, error: LinkError) -> None:
        """The link did not take these bytes; time is the bridge's, in s."""
        self.bytes_unsent(self._network.name, time, data, error)

    def bytes_unsent(self, network: str, time: float, data: bytes, error: LinkError) -> None:
        """The link of one of several networks did not take these bytes.

        Args:
            network: Its name.
            time: The bridge's time, in s.
            data: The bytes.
            error: Why.
        """
        refused = UnsentBytes(network, data, isinstance(error, LinkTimeoutError), bare_text(error))
        self.record("/wire/unsent", refused, time)

    def received(self, event: Received | Rejected) -> None:
        """A message was decoded, or bytes were refused."""
        self._take(event)

    def _take(self, event: Received | Rejected) -> None:
        if isinstance(event, Rejected):
            self.record("/wire/rejected", RejectedInput(event.reason.value, event.detail, event.raw), event.time)
            return
        message = event.message
        self._message(message, sender_suffix(event.system, event.component, event.sequence), event.time)
        self._drawing.received(event)
        if isinstance(message, CommandAck):
            self._rehearsed(event.system, message)
        elif isinstance(message, Statustext):
            self._say(event.time, message.severity, message.text, f"robot {event.system}")

    def arrived(self, came: Arrivals) -> None:
        """Messages were decoded and bytes refused, many at once: each is an entry, as of `received`."""
        count = sum(len(batch.rows) for batch in came.batches.values())
        if count < MANY or count < MANY * len(came.events) or not IN_ROWS.issuperset(came.batches):
            self._take_each(came.objects() if came.batches else came.events)
            return
        parts, first = [self._entries_of(batch) for batch in came.batches.values()], 0
        for event, place in zip(came.events, came.places, strict=True):
            self._writer.write_rows([part.between(first, place) for part in parts])
            self._take(event)
            first = place
        self._writer.write_rows([part.between(first, sys.maxsize) for part in parts])
        for batch in came.batches.values():
            self._drawing.heard_rows(batch)

    def _take_each(self, events: Sequence[Received | Rejected]) -> None:
        """As `_take`, in a hurry."""
        looked_into = LOOKED_INTO | self._drawing.kinds
        write, channel_of = self._writer.write, self._channel_of
        for event in events:
            if isinstance(event, Rejected) or (kind := type(event.message)) in looked_into:
                self._take(event)
            else:
                channel, encode = channel_of(kind)
                suffix = sender_suffix(event.system, event.component, event.sequence)
                write(channel, event.time, encode(event.message) + suffix)

    def _entries_of(self, batch: Batch) -> EntryRows:
        channel, _ = self._channel_of(batch.message)
        data = encode_rows(batch.message, batch.rows, batch.system, batch.component, batch.sequence)
        return EntryRows(channel, batch.time, batch.place, data)

    def sent_rows(self, time: float, message: type[Message], rows: Rows) -> None:
        """Many messages of ours of one kind were sent: each is an entry, as of `sent`."""
        count = len(rows)
        if count < MANY or message not in IN_ROWS:
            for one in messages_of(message, rows):
                self._give(time, one)
            return
        channel, _ = self._channel_of(message)
        data = encode_rows(message, rows, *self._sender)
        self._writer.write_rows([EntryRows(channel, np.full(count, time), np.arange(count), data)])

    def sent(self, time: float, message: Message) -> None:
        """A message of ours was sent; time is the bridge's, in s."""
        self._give(time, message)

    def _give(self, time: float, message: Message) -> None:
        self._drawing.sent(message)
        self._message(message, self._host, time)
        if isinstance(message, CommandLong) and message.command == Command.INJECT_FAILURE:
            self._failures[message.target_system] = message

    def event(self, event: Event) -> None:
        """The peer reports something; what was received or rejected comes through `received` as well and is left out."""
        if isinstance(event, PeerFound):
            self.note("link", f"robot {event.system} answers", system=event.system)
        elif isinstance(event, PeerLost):
            self.note("link", f"robot {event.system} is lost: {event.cause}", system=event.system, cause=event.cause)
        elif isinstance(event, LinkNews):
            self.note("link", event.text)
        elif isinstance(event, StreamStopped | StreamBack):
            self.note("link", event.text, system=event.system, stream=event.stream)
        elif isinstance(event, PeerBack):
            words = "is back, restarted" if event.rebooted else "is back"
            self.note("link", f"robot {event.system} {words}", system=event.system, rebooted=event.rebooted)

    def _rehearsed(self, system: int, ack: CommandAck) -> None:
        """A robot that was asked to have something fail says that it does."""
        if ack.command != Command.INJECT_FAILURE or ack.result == CommandResult.IN_PROGRESS:
            return
        asked = self._failures.pop(system, None)
        if asked is not None and ack.result == CommandResult.ACCEPTED:
            how = "ends" if asked.param2 == FailureType.OK else "begins"
            what = failure_in_words(asked.param1, asked.param2, asked.param3)
            self.note("fault", f"fault {how}: {what}, rehearsed", system=system)

    # --- what happens above the bridge -------------------------------------------------------------------------------

    def note(self, kind: str, text: str, **fields: object) -> None:
        """Something worth telling a person.

        Args:
            kind: `link`, `safety`, `bout`, ...
            text: What happened, in words.
            **fields: The particulars, such as JSON can hold.
        """
        self._noted(kind, text, json.dumps(fields, sort_keys=True, default=str))

    def _noted(self, kind: str, text: str, particulars: str) -> None:
        self.record(EVENTS, EventRecord(kind, text, particulars), self.now)
        self._say(self.now, SEVERITIES.get(kind, 6), text, kind)

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """A metadata record; `robot` holds the robot's parameters."""
        self._writer.metadata(name, values)

    def attachment(self, name: str, data: bytes, *, media_type: str = "application/octet-stream") -> None:
        """A file of the run, whole, inside the log: never one that holds a key.

        Args:
            name: Name of the attachment.
            data: Its content.
            media_type: What it is, as `application/json`.
        """
        self._writer.attachment(name, data, media_type=media_type, time=self.now)

    def flush(self) -> None:
        """Hand everything to the operating system."""
        self._writer.flush()

    def close(self) -> None:
        """Finish the log; safe to repeat, and after a failure.

        Raises:
            LogError: The disk does not take the rest.
        """
        self._writer.close()

    def discard(self) -> None:
        """Leave no log: nothing has been said."""
        self._writer.discard()

    def record(self, topic: str, record: object, time: float, kind: type | None = None) -> None:
        """Write an entry.

        Args:
            topic: Its topic: all entries of one are of the same kind.
            record: One of `hil.mcaplog.records`.
            time: Log time in s.
            kind: What it is written as; None: as what it is.
        """
        found = self._records.get(topic)
        if found is None:
            schema = record_schema(kind or type(record))
            found = self._records[topic] = (self._writer.channel(topic, schema), compile_encoder(schema))
        channel, encode = found
        self._writer.write(channel, time, encode(record))

    def _message(self, message: Message, sender: bytes, time: float) -> None:
        if isinstance(message, SetupSigning):  # a key does not belong into a log
            return
        channel, encode = self._channel_of(type(message))
        self._writer.write(channel, time, encode(message) + sender)

    def _channel_of(self, message: type[Message]) -> tuple[int, Encoder]:
        """Channel and encoder of a kind of message."""
        found = self._messages.get(message)
        if found is None:
            schema = message_schema(message)
            found = self._messages[message] = (self._writer.channel(schema.topic, schema), compile_encoder(schema))
        return found

    def _say(self, time: float, severity: int, text: str, source: str) -> None:
        self._writer.write(self._writer.raw_channel("/log", *TEXT), time, encode_text(time, severity, text, source))


class Network:
    """The steps and the bytes of one network.

    Args:
        writer: Takes the entries.
        name: Name of the network.

    Attributes:
        name: As given.
    """

    def __init__(self, writer: LogSink, name: str) -> None:
        self.name = name
        self._write = writer.write
        self._step_channel = writer.channel("/bridge/step", record_schema(BridgeStep))
        self._rx_channel, self._tx_channel = (
            writer.channel(topic, record_schema(WireBytes)) for topic in ("/wire/rx", "/wire/tx")
        )
        self._encode_step = step_encoder(name)
        self._encode_rx, self._encode_tx = (wire_encoder(direction, name) for direction in ("rx", "tx"))

    def step(self, time: float, chunks: Sequence[tuple[float, bytes]], met: Circumstances) -> None:
        """See `Tap.step`."""
        self._write(self._step_channel, time, self._encode_step(time, chunks, met))

    def wire_rx(self, time: float, data: bytes) -> None:
        """See `Tap.wire_rx`."""
        self._write(self._rx_channel, time, self._encode_rx(data))

    def wire_tx(self, time: float, data: bytes) -> None:
        """See `Tap.wire_tx`."""
        self._write(self._tx_channel, time, self._encode_tx(data))


class OneOfSeveral:
    """Records one of several networks: its own steps and bytes, and all else as the recorder does.

    Args:
        recorder: Has the log.
        network: The network.
    """

    def __init__(self, recorder: WireLog, network: Network) -> None:
        self._recorder = recorder
        self._network = network
        self.of_network = recorder.of_network
        self.opened = recorder.opened
        self.received = recorder.received
        self.sent = recorder.sent
        self.arrived = recorder.arrived
        self.sent_rows = recorder.sent_rows
        self.event = recorder.event
        self.wire_rx = network.wire_rx
        self.wire_tx = network.wire_tx

    def unsent(self, time: float, data: bytes, error: LinkError) -> None:
        """See `Tap.unsent`."""
        self._recorder.bytes_unsent(self._network.name, time, data, error)

    def session_drawn(self, number: int) -> None:
        """See `Tap.session_drawn`."""
        self._recorder.number_drawn(self._network.name, number)

    def step(self, time: float, chunks: Sequence[tuple[float, bytes]], met: Circumstances) -> None:
        """See `Tap.step`."""
        self._recorder.now = time
        self._network.step(time, chunks, met)
