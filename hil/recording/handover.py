"""What the control process hands over to the recorder's, and how it becomes the recorder's calls again.

An item is a tuple: a kind, then plain values that `marshal` carries, which takes a tenth of a microsecond for one. Messages go
as the values of their fields and not as frames: what a frame meant depends on what came before it (on CAN), and on a key.
"""

from __future__ import annotations

import marshal
from collections.abc import Callable
from dataclasses import fields
from operator import attrgetter, index, itemgetter
from types import NoneType
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np

from firmware_protocol.errors import LinkError, bare_text
from firmware_protocol.events import Received, Rejected, RejectReason
from firmware_protocol.messages import HOST_COMPONENT, HOST_SYSTEM, MESSAGES, SetupSigning
from firmware_protocol.wire.batch import Arrivals, Batch
from firmware_protocol.wire.codec import open_codec
from firmware_protocol.wire.fields import wire_fields
from firmware_protocol.wire.rows import ROWS
from hil.bridge.operator import OperatorInput
from hil.bridge.taps import NOTHING, Circumstances
from hil.mcaplog.records import RECORDS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.wire.codec import Codec
    from firmware_protocol.wire.fields import Message
    from firmware_protocol.wire.rows import Rows
    from hil.bridge.taps import Tap
    from hil.recording.recorder import Recorder

Item = tuple[Any, ...]
"""A kind, and what belongs to it."""

STEP, RX, TX, RECEIVED, SENT, RECORD, NOTE, METADATA, PIECE, ATTACHMENT, FLUSH, NETWORK, OF_NETWORK, CLOSE, DISCARD, REPORT = (
    range(16)
)
ARRIVED, SENT_ROWS, HEARD, AWAITED = range(16, 20)
"""Kinds of items."""
_OVERHEARD: Final = frozenset({RECEIVED, SENT, ARRIVED, SENT_ROWS})

PIECE_SIZE: Final = 1 << 18
"""An attachment is handed over in pieces of so many bytes at most."""

Values = Callable[[object], tuple[Any, ...]]
"""An object -> the values of its fields."""


def _values(names: Sequence[str]) -> Values:
    if len(names) > 1:
        return attrgetter(*names)
    return lambda thing: tuple(getattr(thing, name) for name in names)


_FIELDS: Final = {kind: tuple(name for name, _ in wire_fields(kind)) for kind in MESSAGES.values() if kind is not SetupSigning}
MESSAGE_VALUES: Final[dict[type[Message], tuple[int, Values]]] = {
    kind: (kind.ID, _values(names)) for kind, names in _FIELDS.items()
}
"""By message: its id, and what takes it apart. SETUP_SIGNING, which carries a key, has no place here, and is not recorded."""
_MESSAGES: Final = {kind.ID: (kind, names) for kind, names in _FIELDS.items()}
RECORD_VALUES: Final[dict[type, tuple[int, Values]]] = {
    kind: (number, _values([field.name for field in fields(kind)])) for number, kind in enumerate(RECORDS)
}
"""By kind of entry: its number, and what takes it apart."""


EXACT: Final = frozenset({int, float, str, bytes, tuple, bool, NoneType})
"""Types that `marshal` takes, what is in a tuple granted."""


def plain(value: Any) -> Any:  # noqa: ANN401 - whatever it is worth
    """A value as `marshal` takes it, which asks for exact types: no enumeration, none of numpy's numbers.

    Args:
        value: A value of a message's or an entry's field, or an item of them.
    """
    for kinds, exact in _EXACT:
        if isinstance(value, kinds):
            return exact(value)
    return index(value) if hasattr(value, "__index__") else float(value)


def exact(values: Item) -> Item:
    """The values of an entry or a message as `marshal` takes them, but for what may be in a tuple.

    Args:
        values: A codec makes plain numbers, a program may not.
    """
    return values if EXACT.issuperset(map(type, values)) else tuple([plain(value) for value in values])


_EXACT: Final[tuple[tuple[Any, Callable[[Any], Any]], ...]] = (
    ((bool, NoneType), lambda value: value),
    (str, str.__str__),
    (float, float),
    ((tuple, list), lambda value: tuple(map(plain, value))),
    ((bytes, bytearray, memoryview), bytes),
    (dict, lambda value: {plain(key): plain(one) for key, one in value.items()}),
)
"""Kinds of values, the commonest first, and what makes one of the exact type."""


def pack(content: Any) -> bytes:  # noqa: ANN401 - plain values, or nearly
    """Items as bytes.

    Args:
        content: Items, or what else is made of plain values.
    """
    try:
        return marshal.dumps(content)
    except ValueError:  # an enumeration, a number of numpy's
        return marshal.dumps(plain(content))


def unpack(data: bytes) -> Any:  # noqa: ANN401 - what was packed
    """The way back.

    Args:
        data: What `pack` made, in our own process, and a pipe of ours has brought.
    """
    return marshal.loads(data)  # noqa: S302 - see above


def circumstances(met: Circumstances) -> Item:
    """What a step has met, taken apart.

    Args:
        met: What it has met.
    """
    inputs = tuple((one.what, one.robot) for one in met.inputs)
    return inputs, _error(met.lost), _error(met.ended), met.back, tuple(met.news), met.dropped


def _error(error: LinkError | None) -> tuple[str, str] | None:
    return None if error is None else (error.url, bare_text(error))


def _met(item: Item) -> Circumstances:
    inputs, lost, ended, back, news, dropped = item
    return Circumstances(
        inputs=tuple(OperatorInput(*one) for one in inputs),
        lost=None if lost is None else LinkError(*lost),
        ended=None if ended is None else LinkError(*ended),
        back=back,
        news=news,
        dropped=dropped,
    )


class Overhearing(Protocol):
    """Is told of messages as the recorder is; see `Tap`."""

    def received(self, event: Received | Rejected) -> None:
        """A message was decoded, or input rejected."""
        ...

    def arrived(self, came: Arrivals) -> None:
        """Likewise, many at once."""
        ...

    def sent(self, time: float, message: Message) -> None:
        """A message of the host was sent."""
        ...

    def sent_rows(self, time: float, message: type[Message], rows: Rows) -> None:
        """Many messages of the host, all of a kind, were sent."""
        ...


class Playback:
    """Makes the recorder's calls again of the items that are handed over.

    Args:
        recorder: Writes the log.
        overhearing: Is told of the messages, too; None: nobody is.
        answer: Says to the control process that something has been done: `flushed`.
        report: Draws the report of a log that is closed, into a folder.
        awaited: Is told that a browser is being started that will look on.

    Attributes:
        recorder: As given.
    """

    def __init__(
        self,
        recorder: Recorder,
        answer: Callable[[str], None],
        report: Callable[[str], None] = lambda _: None,
        overhearing: Overhearing | None = None,
        awaited: Callable[[], None] = lambda: None,
    ) -> None:
        self.recorder = recorder
        self._listeners: list[Overhearing] = [recorder] if overhearing is None else [recorder, overhearing]
        self._answer = answer
        self._networks: list[Tap] = []
        self._pieces: list[bytes] = []
        self._codecs: dict[tuple[int, int], Codec] = {}
        self._calls: dict[int, Callable[..., None]] = {
            STEP: self._step,
            RX: recorder.wire_rx,
            TX: recorder.wire_tx,
            RECEIVED: self._received,
            SENT: self._sent,
            ARRIVED: self._arrived,
            SENT_ROWS: self._sent_rows,
            RECORD: self._record,
            NOTE: self._note,
            METADATA: recorder.metadata,
            PIECE: self._pieces.append,
            ATTACHMENT: self._attachment,
            FLUSH: self._flush,
            NETWORK: self._network,
            OF_NETWORK: self._of_network,
            CLOSE: recorder.close,
            DISCARD: recorder.discard,
            REPORT: report,
            HEARD: self._heard,
            AWAITED: awaited,
        }

    def take(self, items: Sequence[Item]) -> None:
        """Make the calls of a batch.

        Args:
            items: What was handed over, in order.
        """
        calls = self._calls
        for item in items:
            calls[item[0]](*item[1:])

    def overhear(self, items: Sequence[Item]) -> None:
        """The log is written no further: tell the messages of a batch to who overhears, and nobody else.

        Args:
            items: What was handed over, in order.
        """
        self._listeners = [one for one in self._listeners if one is not self.recorder]
        self.take([item for item in items if self._listeners and item[0] in _OVERHEARD])

    def _step(self, time: float, chunks: Sequence[tuple[float, bytes]], met: Item | None = None) -> None:
        self.recorder.step(time, chunks, NOTHING if met is None else _met(met))

    def _heard(self, number: int, way: int, wire: str, time: float, data: bytes) -> None:
        """Decode what has passed on a line that is not a bridge's, one way."""
        codec = self._codecs.get((number, way))
        if codec is None:
            codec = self._codecs[number, way] = open_codec(wire, system=HOST_SYSTEM, component=HOST_COMPONENT)
        tap: Tap = self.recorder if number < 0 else self._networks[number]
        tap.step(time, (), NOTHING)
        for event in codec.receive(data, time):
            if isinstance(event, Received) and type(event.message) is not SetupSigning:
                tap.received(event)

    def _received(self, time: float, number: int, values: Item, *sender: int) -> None:
        system, component, sequence = sender
        event = Received(_message(number, values), system, component, sequence, time, b"")
        for listener in self._listeners:
            listener.received(event)

    def _sent(self, time: float, number: int, values: Item) -> None:
        message = _message(number, values)
        for listener in self._listeners:
            listener.sent(time, message)

    def _arrived(self, batches: Sequence[Item], others: Sequence[Item], refused: Sequence[Item]) -> None:
        events: list[tuple[int, Received | Rejected]] = [
            (place, Rejected(RejectReason(reason), raw, time, detail)) for place, reason, raw, time, detail in refused
        ]
        for place, number, values, system, component, sequence, time in others:
            events.append((place, Received(_message(number, values), system, component, sequence, time, b"")))
        events.sort(key=itemgetter(0))
        found = [_batch(*batch) for batch in batches]
        came = Arrivals(
            {batch.message: batch for batch in found}, [event for _, event in events], [place for place, _ in events]
        )
        for listener in self._listeners:
            listener.arrived(came)

    def _sent_rows(self, time: float, number: int, rows: bytes) -> None:
        kind = MESSAGES[number]
        for listener in self._listeners:
            listener.sent_rows(time, kind, np.frombuffer(rows, ROWS[kind]))

    def _record(self, topic: str, number: int, values: Item, time: float) -> None:
        self.recorder.record(topic, RECORDS[number](*values), time)

    def _note(self, kind: str, text: str, particulars: str, time: float) -> None:
        self.recorder.now = time
        self.recorder._noted(kind, text, particulars)  # noqa: SLF001 - `note`, once the particulars are in words

    def _attachment(self, name: str, media_type: str, time: float) -> None:
        self.recorder.now = time
        self.recorder.attachment(name, b"".join(self._pieces), media_type=media_type)
        self._pieces.clear()

    def _flush(self) -> None:
        self.recorder.flush()
        self._answer("flushed")

    def _network(self, name: str) -> None:
        self._networks.append(self.recorder.of_network(name))

    def _of_network(self, number: int, kind: int, *values: Any) -> None:  # noqa: ANN401 - an item's
        network = self._networks[number]
        if kind == STEP:
            time, chunks, *met = values
            network.step(time, chunks, _met(met[0]) if met else NOTHING)
        elif kind == RX:
            network.wire_rx(*values)
        else:
            network.wire_tx(*values)


def packed_batch(batch: Batch) -> Item:
    """Messages of one kind, taken apart.

    Args:
        batch: The messages.
    """
    columns = (batch.system, batch.component, batch.sequence, batch.time, batch.place)
    return batch.message.ID, batch.rows.tobytes(), *[column.tobytes() for column in columns]


def _batch(number: int, rows: bytes, *columns: bytes) -> Batch:
    kind = MESSAGES[number]
    types = (np.uint8, np.uint8, np.uint8, np.float64, np.intp)
    each = [np.frombuffer(column, type_) for column, type_ in zip(columns, types, strict=True)]
    return Batch(kind, np.frombuffer(rows, ROWS[kind]), *each)


def _message(number: int, values: Item) -> Message:
    kind, names = _MESSAGES[number]
    message = kind.__new__(kind)
    message.__dict__.update(zip(names, values, strict=True))  # past the frozen __setattr__, as a codec does
    return message
