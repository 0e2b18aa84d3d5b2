"""The log of a wire: the same steps, bytes and messages as a recorder's, without a role, its pictures and its learner."""

from __future__ import annotations

from typing import TYPE_CHECKING

from recordings import ABOUT, step

from firmware_protocol.events import Received
from firmware_protocol.messages import CommandAck, CommandLong, RefereeState, Statustext
from hil.mcaplog import LogReader
from hil.recording.recorder import Recorder
from hil.recording.wire_log import WireLog

if TYPE_CHECKING:
    from pathlib import Path

    from firmware_protocol.wire.batch import Batch
    from firmware_protocol.wire.fields import Message
    from hil.recording.drawing import Drawing

SEEN = RefereeState(1.0, 1, 1.0, (0.1, 0.2), 1.5, (0.2, 0.0), -1.0, 0.1, 1, 0, 1)


def record(log: WireLog) -> None:
    with log:
        for number in range(100):
            step(log, number)
        for message in (SEEN, Statustext(6, "hello")):
            log.received(Received(message, 1, 25, 0, 1.0, b""))


def entries(path: Path, *, pictures: bool) -> list[tuple[str, float, str]]:
    topics = {entry.topic for entry in LogReader(path).entries()}
    drawn = {topic for topic in topics if topic.startswith(("/junior/plot", "/arena", "/tf"))}
    assert bool(drawn) is pictures
    return [(entry.topic, entry.time, str(entry.value)) for entry in LogReader(path).entries(sorted(topics - drawn))]


def test_it_is_a_recorders_log_without_the_pictures(tmp_path: Path) -> None:
    record(WireLog(tmp_path / "wire.mcap", **ABOUT, lockstep=True))
    record(Recorder(tmp_path / "all.mcap", **ABOUT, lockstep=True))
    found = entries(tmp_path / "wire.mcap", pictures=False)
    assert found == entries(tmp_path / "all.mcap", pictures=True)
    assert {"/bridge/step", "/wire/rx", "/wire/tx", "/junior/sensors", "/referee/state", "/log"} <= {
        topic for topic, _, _ in found
    }


class Sketch:
    """Draws nothing, and remembers what it was shown."""

    kinds: frozenset[type[Message]] = frozenset({CommandAck, Statustext})

    def __init__(self) -> None:
        self.heard: list[type[Message]] = []
        self.said: list[type[Message]] = []

    def received(self, event: Received) -> None:
        self.heard.append(type(event.message))

    def heard_rows(self, batch: Batch) -> None:
        self.heard += [batch.message] * len(batch.rows)

    def sent(self, message: Message) -> None:
        self.said.append(type(message))


def test_whoever_draws_is_shown_every_message(tmp_path: Path) -> None:
    sketch = Sketch()

    class Sketched(WireLog):
        def _make_drawing(self) -> Drawing:
            return sketch

    with Sketched(tmp_path / "log.mcap", **ABOUT, lockstep=True) as log:
        log.sent(0.5, CommandLong(1, 1, 400))
        for message in (CommandAck(400, 0), Statustext(6, "hello")):
            log.received(Received(message, 1, 1, 0, 1.0, b""))
    assert (sketch.said, sketch.heard) == ([CommandLong], [CommandAck, Statustext])
