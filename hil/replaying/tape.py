"""A log, read once from its start: its steps for those who replay them, its entries for those who compare."""

from __future__ import annotations

import json
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, NoReturn, TypeVar

from firmware_protocol.errors import HilError
from hil.bridge.operator import INTERRUPT
from hil.mcaplog.making.slimming import kept_of
from hil.mcaplog.reading.reader import LogReader, RawEntry
from hil.mcaplog.records import EVENTS, BridgeOpening, BridgeStep, EventRecord, SessionDrawn, UnsentBytes, WireBytes
from hil.mcaplog.writing.writer import CONFIG, CUT
from hil.replaying.bounds import what_can_not_be
from hil.working import WorkerError
from hil.working.recorded import CUT_SHORT
from pal_advisor.fields import FieldError, Fields

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from hil.mcaplog.limits import ReadLimits
    from hil.working.recorded import Recorded

R = TypeVar("R")

OPEN: Final = "/bridge/open"
SESSION: Final = "/bridge/session"
STEP: Final = "/bridge/step"
RX: Final = "/wire/rx"
TX: Final = "/wire/tx"
UNSENT: Final = "/wire/unsent"
RECORDER: Final = "recorder"
"""Kind of the event that tells of entries that the recorder has lost."""
_KINDS: Final[dict[str, type]] = {
    OPEN: BridgeOpening, SESSION: SessionDrawn, STEP: BridgeStep, RX: WireBytes, TX: WireBytes, UNSENT: UnsentBytes,
}  # fmt: skip


_DIGITS: Final = 19
_EVERY: Final = 1000
"""Entries between two tellings of how much has been read."""


class ReplayError(HilError):
    """A log can't be replayed; the text says why."""


class ReplayEndedError(HilError):
    """The log ends here: the recorded run went on, or not, but nothing more of it is known."""


@dataclass(slots=True)
class Step:
    """One step of a network.

    Attributes:
        number: Of all steps in the log, from 0.
        record: What the bridge met.
        chunks: What it took in: stamps in s, bytes; filled as the log is read on.
        missing: Chunks whose bytes have not been read yet.
        writes: What was written until the next step of this network, and what became of it.
        over: All that was written is known.
    """

    number: int
    record: BridgeStep
    chunks: list[tuple[float, bytes]] = field(default_factory=list)
    missing: int = 0
    writes: deque[WireBytes | UnsentBytes] = field(default_factory=deque)
    over: bool = False


class _NetworkTape:
    """What has been read of one network, and not been asked for yet."""

    def __init__(self) -> None:
        self.opening: BridgeOpening | None = None
        self.numbers: deque[int] = deque()
        self.steps: deque[Step] = deque()
        self.unfilled: deque[Step] = deque()
        self.current = Step(-1, BridgeStep(0.0, (), ()))
        self.last = self.current


class Tape:
    """A log to be replayed.

    Args:
        path: The log.
        limits: What it may unpack to.
        compared: Its entries are wanted too (`next_entry`).

    Attributes:
        path: The log.
        reader: What reads it.
        config: Its metadata `config`.
        recovered: What was wrong with the log that it was made from, in words; empty where it is as it was written.
        kept: Patterns of the topics that it has, where it was slimmed; None: it has them all.
        files: Its attachments, by name.
        steps: Steps read so far.
        span: First and last log time read so far, in s.
        ended: It has been read to its end.
        interrupted: A step has been handed out by which the run was interrupted.
        gaps: What the recorder could not write, in words; empty where it wrote everything, as far as the log has been read.
        on_read: Is told what share of the log has been read, 0..1, now and then; None: nobody.

    Raises:
        LogError: It can't be read, or is no log.
        UnreadableLogError: There is something in it, and nothing of it can be read.
        ReplayError: It does not say how the run was begun.
    """

    def __init__(self, path: Path, limits: ReadLimits, *, compared: bool) -> None:
        self.path = path
        self.reader = LogReader(path, limits)
        for _ in self.reader.entries(topics=()):
            pass
        if CONFIG not in self.reader.metadata and not self.reader.whole:
            for _ in self.reader.raw_entries():
                pass
            self.reader.require_something()
        self.config = dict(self.reader.metadata.get(CONFIG, {}))
        self.kept = kept_of(self.reader.metadata)
        self.files = {name: found.data for name, found in self.reader.attachments.items()}
        self.steps = 0
        self.entries = 0
        self.span: tuple[float, float] | None = None
        self._compared = compared
        cut = self.reader.metadata.get(CUT)
        self._cut = cut is not None
        self.recovered = cut.get("why", "") if cut is not None and "entries" in cut else ""
        self._most = _whole_number(cut.get("entries", "")) if cut is not None else None
        self._raw = self.reader.raw_entries(None if compared else tuple(_KINDS))
        self._entries: deque[RawEntry] = deque()
        self._networks: dict[str, _NetworkTape] = {}
        self._results: dict[str, list[Any]] = {}
        self.ended = False
        self.interrupted = False
        self.gaps = ""
        self.on_read: Callable[[float], object] | None = None

    @property
    def cut_off(self) -> bool:
        """The log has been read to its end, or to what is missing in it, and that is not where the run ended."""
        return self.ended and (self._cut or self.reader.truncated or bool(self.reader.stopped or self.reader.damage))

    def first_step(self) -> None:
        """Read on to the first step.

        Raises:
            ReplayError: It does not begin with the opening of a network, or has no step.
        """
        if not self.has_step():
            text = f"{self.path} has no step of a bridge that could be read: there is nothing to replay"
            if not self.reader.whole:
                text += f". It is {self.reader.health(1)}. What there is of it, hil log recover gets"
            raise ReplayError(text)
        if not any(network.opening for network in self._networks.values()):
            raise ReplayError(
                f"{self.path} does not say how its bridge was opened: it was recorded by an older version, or its beginning is "
                "missing"
            )

    def has_step(self) -> bool:
        """Read on to the first step; False where there is none."""
        while not self.steps:
            if not self._read_on():
                return False
        return True

    @property
    def networks(self) -> list[str]:
        """Names of the networks that were opened, as far as the log has been read."""
        return [name for name, network in self._networks.items() if network.opening is not None]

    def opening(self, network: str) -> BridgeOpening:
        """How the bridge of a network was opened.

        Args:
            network: Its name.

        Raises:
            ReplayEndedError: The log does not have it.
        """
        found = self._of(network)
        while found.opening is None:
            self._more(f"no network {network} was opened")
        return found.opening

    def number(self, network: str) -> int:
        """The next number that was drawn by chance; see `opening`."""
        found = self._of(network)
        while not found.numbers:
            self._more("no further session was opened")
        return found.numbers.popleft()

    def current(self, network: str) -> Step:
        """The step of a network that was handed out last."""
        return self._of(network).current

    def peek(self, network: str) -> Step | None:
        """The next step of a network, which stays where it is; None at the end."""
        found = self._of(network)
        while not found.steps or found.steps[0].missing:
            if not self._read_on():
                return None
        return found.steps[0]

    def take(self, network: str) -> Step:
        """The next step of a network, with the bytes that it took in.

        Args:
            network: Its name.

        Raises:
            ReplayEndedError: There is none.
        """
        if self.peek(network) is None:
            raise ReplayEndedError(f"{self.path} has no further step")
        found = self._of(network)
        found.current = found.steps.popleft()
        self.interrupted = self.interrupted or INTERRUPT in found.current.record.inputs
        return found.current

    def written(self, network: str) -> WireBytes | UnsentBytes | None:
        """What was written next on a network before its next step; None where nothing was.

        Args:
            network: Its name.
        """
        step = self._of(network).current
        while not step.writes and not step.over:
            if not self._read_on():
                return None
        return step.writes.popleft() if step.writes else None

    def result(self, recorded: Recorded[R], number: int) -> R:
        """What came of something that other processes did.

        Args:
            recorded: How the log tells of it.
            number: How many of its kind the log tells of before it.

        Raises:
            ReplayEndedError: The log tells of no further one.
            ReplayError: It is not as this version tells of it.
            WorkerError: No further one came then.
            KeyboardInterrupt: The run was interrupted then.
        """
        results = self._results.get(recorded.topic)
        if results is None:
            reader = LogReader(self.path, self.reader.limits)
            results = self._results[recorded.topic] = [reader.decoded(entry) for entry in reader.raw_entries((recorded.topic,))]
        if number >= len(results):
            self._raise_what_cut_it_short(recorded.topic)
        found = recorded.result_of(results[number])
        if found is None:
            raise ReplayError(f"{self.path}: an entry of {recorded.topic} is not as this version writes them")
        return found

    def _raise_what_cut_it_short(self, topic: str) -> NoReturn:
        reader = LogReader(self.path, self.reader.limits)
        for entry in reader.entries([EVENTS]):
            event = entry.value
            if isinstance(event, EventRecord) and event.kind == CUT_SHORT:
                try:
                    particulars = Fields(json.loads(event.fields))
                    self.interrupted = particulars.flag("interrupted")
                    status = particulars.integer("status", 0, 255)
                except (FieldError, ValueError, RecursionError) as error:
                    raise ReplayError(f"{self.path} does not say properly what cut the run short: {error}") from error
                raise KeyboardInterrupt if self.interrupted else WorkerError(event.text, status)
        if reader.truncated or reader.damage or self._cut:
            self._entries.clear()
            self.ended = True
        raise ReplayEndedError(f"{self.path} has no further entry of {topic}")

    def next_entry(self) -> RawEntry | None:
        """The next entry, in the order of the log; None at its end."""
        while not self._entries:
            if not self._read_on():
                return None
        return self._entries.popleft()

    def put_back(self, entry: RawEntry) -> None:
        """Let an entry be the next one again."""
        self._entries.appendleft(entry)

    def decoded(self, entry: RawEntry) -> Any:  # noqa: ANN401 - whatever the log holds
        """What an entry says: a record or message of this program, or what the log's own schema makes of it; else None."""
        return self.reader.decoded(entry)

    def _of(self, network: str) -> _NetworkTape:
        return self._networks.setdefault(network, _NetworkTape())

    def _more(self, missing: str) -> None:
        if not self._read_on():
            raise ReplayEndedError(f"{self.path} ends: {missing}")

    def _read_on(self) -> bool:
        """Read the next entry; False at the end."""
        entry = None if self.entries == self._most else next(self._raw, None)
        if entry is None or self.reader.damage:  # what follows a gap was said to questions that nobody knows
            self.ended = True
            for network in self._networks.values():
                network.last.over = True
            return False
        self.entries += 1
        if self.on_read is not None and not self.entries % _EVERY:
            self.on_read(self.reader.bytes_read / max(1, self.reader.size))
        at = entry.log_time / 1e9
        self.span = (at, at) if self.span is None else (min(at, self.span[0]), max(at, self.span[1]))
        if self._compared:
            self._entries.append(entry)
        if entry.topic == EVENTS:
            self._hear(self.decoded(entry))
        kind = _KINDS.get(entry.topic)
        if kind is not None:
            found = self.decoded(entry)
            if not isinstance(found, kind):
                raise ReplayError(f"{self.path}: an entry of {entry.topic} at {at:.3f} s is not as this version writes them")
            if wrong := what_can_not_be(found):
                raise ReplayError(f"{self.path}: an entry of {entry.topic} at {at:.3f} s says what can't be: {wrong}")
            self._take(entry.topic, found)
        return True

    def _hear(self, event: object) -> None:
        """Take note of what the recorder could not write."""
        if isinstance(event, EventRecord) and event.kind == RECORDER:
            self.gaps = event.text

    def read_rest(self) -> None:
        """Read on to the end, for `gaps` and for where the log ends."""
        with suppress(ReplayError):
            while self._read_on():
                self._entries.clear()

    def _take(self, topic: str, found: Any) -> None:  # noqa: ANN401 - one of `_KINDS`
        network = self._of(found.link if topic in {RX, TX, UNSENT} else found.network)
        match found:
            case BridgeOpening():
                network.opening = found
            case SessionDrawn():
                network.numbers.append(found.number)
            case BridgeStep():
                self._take_step(network, found)
            case UnsentBytes():
                network.last.writes.append(found)
            case WireBytes() if topic == TX:
                network.last.writes.append(found)
            case _:
                self._fill(network, found.data)

    def _take_step(self, network: _NetworkTape, record: BridgeStep) -> None:
        network.last.over = True
        step = network.last = Step(self.steps, record, missing=len(record.chunk_times))
        self.steps += 1
        network.steps.append(step)
        if step.missing:
            network.unfilled.append(step)

    def _fill(self, network: _NetworkTape, data: bytes) -> None:
        """The bytes of the next chunk whose step has been read: they may come a step later, where a key had to be left out."""
        if not network.unfilled:
            raise ReplayError(f"{self.path}: bytes came before step {self.steps} that no step has taken in")
        step = network.unfilled[0]
        at = len(step.chunks)
        if step.record.chunk_sizes[at] != len(data):
            size = step.record.chunk_sizes[at]
            raise ReplayError(f"{self.path}: step {step.number} took in {size} bytes, and the log has {len(data)} of them")
        step.chunks.append((step.record.chunk_times[at], data))
        step.missing -= 1
        if not step.missing:
            network.unfilled.popleft()


def _whole_number(text: str) -> int | None:
    """A number of a log; None where there is none."""
    return int(text) if text.isascii() and text.isdigit() and len(text) < _DIGITS else None
