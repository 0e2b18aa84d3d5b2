"""A report that is gathered while the log is written, so that nobody has to read the log again.

What is told to the recorder is told to the gatherer as well, as the log will hold it: the same report comes out as of the log
itself. When the coaching is over, a thread begins to draw what will not change any more.
"""

from __future__ import annotations

import gc
from operator import itemgetter
from threading import Thread
from typing import TYPE_CHECKING, Final

from firmware_protocol.events import Received, Rejected
from firmware_protocol.messages import HOST_COMPONENT, HOST_SYSTEM
from firmware_protocol.wire.rows import messages_of
from hil.bridge.taps import NOTHING
from hil.mcaplog.reading.reader import LogReader
from hil.mcaplog.records import SERIES, AdviceRecord, EventRecord
from hil.mcaplog.schemas import message_schema
from hil.recording.handover import MESSAGE_VALUES
from hil.recording.recorder import Recorder
from hil.report.gather import TOLD, Gatherer

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from firmware_protocol.wire.batch import Arrivals
    from firmware_protocol.wire.fields import Message
    from firmware_protocol.wire.rows import Rows
    from hil.bridge.taps import Circumstances
    from hil.mcaplog.writing.sink import LogSink
    from hil.report.link import Frame
    from hil.report.page import Picture
    from hil.report.run_data import RunData

TOGETHER: Final = 1000
"""Frames that are counted at once: each by itself would cost three times the time."""


class ListeningRecorder(Recorder):
    """Records as `Recorder` does, of one network, and gathers what a report tells.

    Args:
        path: As of `Recorder`, like all others.
        run: Likewise.
        config: Likewise.
        link: Likewise.
        lockstep: Likewise.
        writer: Likewise.
        system: Likewise.
        component: Likewise.
    """

    def __init__(
        self,
        path: Path,
        *,
        run: Mapping[str, str],
        config: Mapping[str, str],
        link: str,
        lockstep: bool,
        writer: LogSink,
        system: int = HOST_SYSTEM,
        component: int = HOST_COMPONENT,
    ) -> None:
        self._gatherer = Gatherer(path)
        self._metadata: dict[str, dict[str, str]] = {}
        self._frames: list[Frame] = []
        self._wire: dict[str, list[tuple[float, int]]] = {"rx": [], "tx": []}
        self._coached = False
        self._drawn: dict[str, Picture] = {}
        self._drawing_early: Thread | None = None
        super().__init__(
            path, run=run, config=config, link=link, lockstep=lockstep, system=system, component=component, writer=writer
        )

    def step(self, time: float, chunks: Sequence[tuple[float, bytes]], met: Circumstances = NOTHING) -> None:
        """See `WireLog.step`."""
        super().step(time, chunks, met)
        if met.inputs:
            self._gatherer.asked(met.inputs, _stamp(time))

    def wire_rx(self, time: float, data: bytes) -> None:
        """See `Recorder.wire_rx`."""
        super().wire_rx(time, data)
        self._wire["rx"].append((time, len(data)))

    def wire_tx(self, time: float, data: bytes) -> None:
        """See `Recorder.wire_tx`."""
        super().wire_tx(time, data)
        self._wire["tx"].append((time, len(data)))

    def received(self, event: Received | Rejected) -> None:
        """See `Recorder.received`."""
        super().received(event)
        if isinstance(event, Received):
            self._gather(event)

    def _gather(self, event: Received) -> None:
        kind = type(event.message)
        if kind in MESSAGE_VALUES:
            sender, time = (event.system, event.component), _stamp(event.time)
            self._frames.append((sender, event.sequence, time))
            if kind in TOLD or self._gatherer.robot.system is None:
                self._gatherer.received(event.message, sender, time)
            if len(self._frames) >= TOGETHER:
                self._tell()

    def arrived(self, came: Arrivals) -> None:
        """See `WireLog.arrived`."""
        super().arrived(came)
        if self._gatherer.robot.system is None or not TOLD.isdisjoint(came.batches):
            for event in came.objects():
                if isinstance(event, Received):
                    self._gather(event)
            return
        frames: list[tuple[int, Frame]] = []
        for batch in came.batches.values():
            columns = batch.place, batch.system, batch.component, batch.sequence, batch.time
            for place, system, component, sequence, time in zip(*(one.tolist() for one in columns), strict=True):
                frames.append((place, ((system, component), sequence, _stamp(time))))
        for event, place in zip(came.events, came.places, strict=True):
            if isinstance(event, Received) and type(event.message) in MESSAGE_VALUES:
                sender, time = (event.system, event.component), _stamp(event.time)
                frames.append((place, (sender, event.sequence, time)))
                if type(event.message) in TOLD:
                    self._gatherer.received(event.message, sender, time)
        self._frames += [frame for _, frame in sorted(frames, key=itemgetter(0))]
        if len(self._frames) >= TOGETHER:
            self._tell()

    def _tell(self) -> None:
        """Have what has passed since the last time counted."""
        self._gatherer.came(self._frames)
        for direction, passed in self._wire.items():
            if passed:
                (first, _), (last, _) = min(passed), max(passed)
                self._gatherer.wire(direction, sum(size for _, size in passed), _stamp(first))
                self._gatherer.wire(direction, 0, _stamp(last))
            passed.clear()
        self._frames.clear()

    def sent(self, time: float, message: Message) -> None:
        """See `Recorder.sent`."""
        super().sent(time, message)
        self._gather_sent(time, message)

    def _gather_sent(self, time: float, message: Message) -> None:
        if type(message) in MESSAGE_VALUES:
            self._gatherer.sent(message, message_schema(type(message)).topic, _stamp(time))

    def sent_rows(self, time: float, message: type[Message], rows: Rows) -> None:
        """See `WireLog.sent_rows`."""
        super().sent_rows(time, message, rows)
        for one in messages_of(message, rows):
            self._gather_sent(time, one)

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """See `Recorder.metadata`."""
        super().metadata(name, values)
        self._metadata[name] = dict(values)

    def record(self, topic: str, record: object, time: float, kind: type | None = None) -> None:
        """See `WireLog.record`."""
        super().record(topic, record, time, kind)
        self._gatherer.record(record, _stamp(time))
        if isinstance(record, AdviceRecord):
            self._coached = True
        elif self._coached and isinstance(record, EventRecord) and record.kind == SERIES and self._drawing_early is None:
            data = self._gatherer.so_far(self._metadata)
            self._drawing_early = Thread(target=self._draw_early, args=(data,), name="pictures of the coaching", daemon=True)
            self._drawing_early.start()

    def _draw_early(self, data: RunData) -> None:
        gc.freeze()  # what has been gathered stays: nobody need look through it for rubbish while pictures are drawn
        from hil.report.write import early_pictures  # noqa: PLC0415 - drawing takes half a second to load

        self._drawn = early_pictures(data)

    def report(self, folder: Path) -> Path:
        """Draw the report of the log, which is closed.

        Args:
            folder: Where it goes.

        Returns:
            The page.

        Raises:
            LogError: The log is not there, or the report can't be written.
        """
        from hil.report.page import Pictures  # noqa: PLC0415 - as above
        from hil.report.write import write_pages  # noqa: PLC0415 - likewise

        if self._drawing_early is not None:
            self._drawing_early.join()
        self._tell()
        reader = LogReader(self.path)
        for _ in reader.entries(()):
            pass  # there is none: what is read is the metadata
        return write_pages(self._gatherer.finish(reader), folder, Pictures(self._drawn)).page


def _stamp(time: float) -> float:
    """A time as a log has it: of whole nanoseconds."""
    return round(time * 1e9) / 1e9
