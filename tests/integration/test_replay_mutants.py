"""What a replay is for: the smallest change of what came in, or of what the program makes of it, is found where it happens."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from itertools import pairwise, product
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pytest
from edited_logs import RX, STEP, TX, EditedLog
from fastcrc.crc16 import mcrf4xx

import hil
import hil.bridge.bridge
from firmware_protocol.events import Received
from firmware_protocol.messages import (
    HOST_COMPONENT,
    HOST_SYSTEM,
    CommandLong,
    JuniorManeuverResult,
    JuniorSensors,
    RobotAlive,
    RobotSession,
)
from firmware_protocol.peer.exchanges.exchange import Exchange
from firmware_protocol.peer.timing import KEEP_ALIVE
from firmware_protocol.wire.codec import open_codec
from firmware_protocol.wire.mavlink_layout import crc_extra
from hil.bridge.bridge import Bridge
from hil.cli.app import run as run_hil
from hil.replaying.network import ReplayClock
from hil.seeds import generator

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.events import Event
    from firmware_protocol.peer.exchanges.exchange import Retry
    from firmware_protocol.wire.fields import Message
    from hil.replaying.difference import Difference

LOGS: Final = Path(__file__).parents[1] / "replay_logs"
HEAD: Final = 10
"""Bytes of a MAVLink frame before its payload."""


@cache
def kept(name: str) -> EditedLog:
    """One of the logs in the repository; not to be changed."""
    return EditedLog.of(LOGS / f"{name}.mcap")


def copied(log: EditedLog) -> EditedLog:
    """A log to be changed."""
    return EditedLog(list(log.entries), {name: dict(values) for name, values in log.metadata.items()}, dict(log.attachments))


def difference(path: Path, *, strict: bool = False) -> Difference:
    """Where a replay parts from a log."""
    report = hil.replay(path, strict=strict)
    assert not report.same
    assert not report.cut_off
    assert report.difference is not None
    assert report.difference.recorded in str(report)
    return report.difference


def messages(data: bytes, *, system: int = HOST_SYSTEM, component: int = HOST_COMPONENT) -> list[Message]:
    """What MAVLink frames hold, as that node hears it."""
    found = open_codec("mavlink", system=system, component=component).receive(data, 0.0)
    return [item.message for item in found if isinstance(item, Received)]


def frames_holding(log: EditedLog, kind: type[Message]) -> list[int]:
    """Places of received chunks that are one whole frame, of this message."""
    return [
        place
        for place in log.places(RX)
        if len(found := messages(data := log.entries[place].value.data)) == 1
        and isinstance(found[0], kind)
        and len(data) == HEAD + data[1] + 2
    ]


def flipped(frame: bytes, byte: int, bit: int, kind: type[Message], *, good: bool) -> bytes:
    """A frame with one bit of its payload changed; its checksum fits, or does not."""
    changed = bytearray(frame)
    changed[HEAD + byte] ^= 1 << bit
    if good:
        changed[-2:] = mcrf4xx(bytes(changed[1:-2]) + bytes((crc_extra(kind),))).to_bytes(2, "little")
    return bytes(changed)


# --- what came in --------------------------------------------------------------------------------------------------------


def changed(frame: bytes, field: str, kind: type[Message]) -> bytes:
    """A frame in which one bit of a field is another, and the checksum fits."""
    told = getattr(messages(frame)[0], field)
    for at, bit in product(range(frame[1]), range(8)):
        other = flipped(frame, at, bit, kind, good=True)
        found = messages(other)
        if found and type(found[0]) is kind and getattr(found[0], field) != told:
            return other
    raise AssertionError(field)


@pytest.mark.parametrize("strict", [False, True])
@pytest.mark.parametrize(("field", "topic"), [("stimulus_after", "/pal/decision"), ("outcome", "/pal/trial")])
def test_one_bit_of_what_was_sensed_in_a_maneuver(field: str, topic: str, *, strict: bool, tmp_path: Path) -> None:
    log = copied(kept("lockstep"))
    place = frames_holding(log, JuniorManeuverResult)[10]
    log.change(place, data=changed(log.entries[place].value.data, field, JuniorManeuverResult))
    found = difference(log.write(tmp_path / "log.mcap"), strict=strict)
    decided = next(at for at in log.places(topic) if at > place)
    assert (found.step, found.topic) == (log.step_of(decided), topic)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> EditedLog:
    """A log that was not slimmed."""
    path = tmp_path_factory.mktemp("whole") / "log.mcap"
    assert run_hil(["bout", "--controller", "chase", "--trials", "1", "--quiet", "--log", str(path)]) == 0
    return EditedLog.of(path)


@pytest.mark.parametrize("field", ["eye", "floor", "travel", "flags"])
def test_one_bit_of_a_reading(field: str, whole: EditedLog, tmp_path: Path) -> None:
    log = copied(whole)
    place = frames_holding(log, JuniorSensors)[40]
    log.change(place, data=changed(log.entries[place].value.data, field, JuniorSensors))
    found = difference(log.write(tmp_path / "log.mcap"), strict=True)
    assert (found.step, found.topic, found.field) == (log.step_of(place), "/junior/sensors", field)


@pytest.mark.parametrize("strict", [False, True])
def test_one_bit_of_a_frame_whose_checksum_tells_of_it(*, strict: bool, tmp_path: Path) -> None:
    log = copied(kept("lockstep"))
    place = frames_holding(log, JuniorManeuverResult)[10]
    log.change(place, data=flipped(log.entries[place].value.data, 3, 5, JuniorManeuverResult, good=False))
    found = difference(log.write(tmp_path / "log.mcap"), strict=strict)
    assert found.step == log.step_of(place)
    if strict:
        assert found.topic == "/wire/rejected"
    else:
        assert found.recorded.startswith("/wire/tx RobotResultAck")  # what came is not acknowledged, which was a good frame


def test_one_bit_of_a_reading_whose_checksum_tells_of_it(whole: EditedLog, tmp_path: Path) -> None:
    log = copied(whole)
    place = frames_holding(log, JuniorSensors)[40]
    log.change(place, data=flipped(log.entries[place].value.data, 3, 5, JuniorSensors, good=False))
    found = difference(log.write(tmp_path / "log.mcap"), strict=True)
    assert found.step == log.step_of(place)
    assert found.topic == "/wire/rejected"


@pytest.mark.parametrize("name", ["lockstep", "pty"])
def test_another_session_number(name: str, tmp_path: Path) -> None:
    log = copied(kept(name))
    host, session = log.places("/bridge/session")
    log.change(session, number=log.entries[session].value.number ^ 1)
    found = difference(log.write(tmp_path / "log.mcap"))
    first = next(place for place in log.places(TX) if any(isinstance(one, RobotSession) for one in said(log, place)))
    assert host < session
    assert (found.step, found.topic, found.field) == (log.step_of(first), TX, "data: RobotSession.session")


def said(log: EditedLog, place: int) -> list[Message]:
    """What the host wrote."""
    return messages(log.entries[place].value.data, system=1, component=1)


@pytest.mark.parametrize("key", ["key a", "key e", "key q"])
def test_a_key_that_is_missing(key: str, tmp_path: Path) -> None:
    log = copied(kept("extra_monitor"))
    place, step = next((place, step) for place, step in log.steps() if key in step.inputs)
    rest = [pair for pair in zip(step.inputs, step.input_robots, strict=True) if pair[0] != key]
    log.change(place, inputs=tuple(what for what, _ in rest), input_robots=tuple(robot for _, robot in rest))
    found = difference(log.write(tmp_path / "log.mcap"))
    obeyed = [at for at in log.places(TX) if at > place and any(isinstance(one, CommandLong) for one in said(log, at))]
    assert found.step in {log.step_of(at) for at in obeyed}
    assert "CommandLong" in found.recorded
    assert "CommandLong" not in found.now


@pytest.mark.parametrize("strict", [False, True])
@pytest.mark.parametrize("name", ["unplugged", "lost"])
def test_a_link_that_is_lost_a_step_later(name: str, *, strict: bool, tmp_path: Path) -> None:
    log = copied(kept(name))
    steps = list(log.steps())
    number = next(number for number, (_, step) in enumerate(steps) if step.lost_link)
    (place, step), (after, _) = steps[number], steps[number + 1]
    log.change(place, lost="", lost_link="")
    log.change(after, lost=step.lost, lost_link=step.lost_link)
    found = difference(log.write(tmp_path / "log.mcap"), strict=strict)
    assert found.step == number
    assert "open it again" in found.recorded


# --- what the program makes of it ----------------------------------------------------------------------------------------

SETTINGS: Final = sorted(
    name
    for name, value in json.loads(kept("lockstep").metadata["config"]["options"])["settings"].items()
    if isinstance(value, float)
)


@pytest.mark.parametrize("name", SETTINGS)
def test_the_last_bit_of_one_setting(name: str, tmp_path: Path) -> None:
    log = copied(kept("lockstep"))
    options = json.loads(log.metadata["config"]["options"])
    options["settings"][name] = math.nextafter(options["settings"][name], math.inf)
    log.metadata["config"]["options"] = json.dumps(options)
    found = difference(log.write(tmp_path / "log.mcap"))
    first = log.places("/pal/checkpoint")[0]  # before the first decision: it covers the settings
    assert first < log.places("/pal/decision")[0]
    assert (found.step, found.topic, found.field) == (log.step_of(first), "/pal/checkpoint", "digest")


@pytest.mark.parametrize("name", ["lockstep", "pty"])
def test_a_keep_alive_a_millisecond_later(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hil.bridge.bridge, "KEEP_ALIVE", KEEP_ALIVE + 0.001)
    found = difference(LOGS / f"{name}.mcap")
    log = kept(name)
    alive = [place for place in log.places(TX) if any(isinstance(one, RobotAlive) for one in said(log, place))]
    times = [log.entries[place].log_time for place in alive]
    late = next(
        number for number in range(1, len(times)) if times[number] - times[number - 1] < round((KEEP_ALIVE + 0.001) * 1e9)
    )
    assert found.step == log.step_of(alive[late])
    assert found.topic == TX
    assert "RobotAlive" in found.recorded
    assert "RobotAlive" not in found.now


def off_by_a_nanosecond(monkeypatch: pytest.MonkeyPatch, step: int, by: float) -> None:
    """Have the program's clock be wrong in one step."""
    made = 0

    def now(clock: ReplayClock) -> float:
        nonlocal made
        made += 1
        return clock.reading + (by if made == step + 2 else 0.0)  # it is read once before the first step

    monkeypatch.setattr(ReplayClock, "now", now)


@pytest.mark.parametrize("step", [0, 7, 100])
@pytest.mark.parametrize("name", ["lockstep", "pty", "can_real_time"])
def test_a_clock_reading_that_is_off_by_a_nanosecond(name: str, step: int, monkeypatch: pytest.MonkeyPatch) -> None:
    off_by_a_nanosecond(monkeypatch, step, 1e-9)
    found = difference(LOGS / f"{name}.mcap", strict=True)
    assert (found.step, found.topic, found.field) == (step, STEP, "clock")


def test_a_nanosecond_that_decides(monkeypatch: pytest.MonkeyPatch) -> None:
    log = kept("lockstep")
    alive = [place for place in log.places(TX) if any(isinstance(one, RobotAlive) for one in said(log, place))]
    steps = [log.step_of(place) for place in alive]
    readings = [step.clock for _, step in log.steps()]
    step = next(
        later for before, later in pairwise(steps) if 0 <= readings[later] - (readings[before] + KEEP_ALIVE) < 1e-9
    )  # it was sent in the very moment
    off_by_a_nanosecond(monkeypatch, step, -1e-9)
    found = difference(LOGS / "lockstep.mcap")
    assert (found.step, found.topic) == (step, TX)
    assert "RobotAlive" in found.recorded
    assert found.now == "nothing more in this step"


def test_a_nanosecond_that_decides_nothing_is_found_by_a_strict_replay_alone(tmp_path: Path) -> None:
    log = copied(kept("lockstep"))
    place = next(
        place for place, entry in enumerate(log.entries) if entry.topic == STEP and log.entries[place + 1].topic == STEP
    )
    log.change(place, clock=log.entries[place].value.clock + 1e-9)
    path = log.write(tmp_path / "log.mcap")
    assert hil.replay(path).same
    found = difference(path, strict=True)
    assert (found.step, found.field) == (log.step_of(place), "log time")


def test_one_try_less(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[float, str]] = []
    ask = Exchange.ask

    def noted(exchange: Exchange[Any], now: float, retry: Retry) -> Sequence[Message]:
        sent = ask(exchange, now, retry)
        if exchange.tries == 2:
            asked.append((now, type(exchange.question).__name__))
        return sent

    monkeypatch.setattr(Exchange, "ask", noted)
    assert hil.replay(LOGS / "faults.mcap").same
    monkeypatch.setattr(Exchange, "ask", ask)
    monkeypatch.setattr(Exchange, "over", lambda exchange, *_: exchange.tries >= 1)
    found = difference(LOGS / "faults.mcap")
    when, question = asked[0]
    assert found.time == pytest.approx(when, abs=1e-9)
    assert question in found.recorded
    assert found.topic in {TX, "/events"}


@pytest.mark.parametrize("at", [0, 3, 11])
def test_two_random_draws_that_change_places(at: int, monkeypatch: pytest.MonkeyPatch) -> None:
    class Swapping(np.random.Generator):
        """Gives one number of `random` after the next one."""

        drawn = -1
        kept = 0.0

        def random(self, *args: Any, **options: Any) -> Any:  # noqa: ANN401 - numpy's own
            if args or options:
                return super().random(*args, **options)
            self.drawn += 1
            if self.drawn == at:
                self.kept = super().random()
                return super().random()
            return self.kept if self.drawn == at + 1 else super().random()

    monkeypatch.setattr("hil.sumo.coaching.generator", lambda *args: Swapping(generator(*args).bit_generator))
    found = difference(LOGS / "lockstep.mcap")
    log = kept("lockstep")
    told = log.places("/pal/credit")[at]  # when it is told of a trial, it draws whether the next is to be the best known
    assert (found.step, found.topic, found.field) == (log.step_of(told), "/pal/credit", "digest")


def test_a_step_that_is_missing(tmp_path: Path) -> None:
    log = copied(kept("lockstep"))
    place = next(place for place, entry in enumerate(log.entries) if entry.topic == STEP and log.entries[place + 1].topic == TX)
    del log.entries[place]
    found = difference(log.write(tmp_path / "log.mcap"))
    assert found.step <= log.step_of(place) + 1


def test_a_bridge_that_makes_one_step_more(monkeypatch: pytest.MonkeyPatch) -> None:
    step, made = Bridge.step, 0

    def twice(bridge: Bridge, wait: float) -> list[Event]:
        nonlocal made
        made += 1
        if made == 50:
            bridge.send(RobotAlive(bridge.host))
        return step(bridge, wait)

    monkeypatch.setattr(Bridge, "step", twice)
    found = difference(LOGS / "lockstep.mcap")
    assert found.topic == TX
    assert found.recorded == "nothing more in this step" or "RobotAlive" not in found.recorded
    assert "RobotAlive" in found.now


@pytest.mark.slow
def test_a_log_that_a_replay_has_just_made_is_the_same_again(tmp_path: Path) -> None:
    for name in ("lockstep", "pty", "extra_monitor"):
        copy = copied(kept(name))
        assert hil.replay(copy.write(tmp_path / f"{name}.mcap"), strict=True).same
        place = copy.places(STEP)[5]
        copy.entries[place] = replace(copy.entries[place], log_time=copy.entries[place].log_time + 1)
        assert difference(copy.write(tmp_path / f"{name}.mcap"), strict=True).field == "log time"
