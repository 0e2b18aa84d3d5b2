"""The recorder in a process of its own: the same bytes as in this one, whatever becomes of either process."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
import pytest
from guest import Guest
from recordings import ABOUT, last_time, step

import hil
from firmware_protocol.errors import LinkClosedError, LinkTimeoutError
from firmware_protocol.events import LinkNews, PeerFound, PeerLost, Received
from firmware_protocol.messages import Command, CommandLong, JuniorSensors, JuniorWheels, RobotAlive, SetupSigning
from firmware_protocol.wire.signing import SigningKey
from hil.bridge.operator import OperatorInput
from hil.bridge.taps import Circumstances, Opening
from hil.files.outputs import OutputExistsError
from hil.mcaplog import LogError, LogReader
from hil.recording import feeds
from hil.recording.feeds import LockstepFeed
from hil.recording.handover import unpack
from hil.recording.process import LinkSharing, RecorderProcess, begin_log
from hil.recording.recorder import Recorder
from pal_advisor.maneuvers import GenerationRecord

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

posix = pytest.mark.skipif(os.name != "posix", reason="signals, pipes with names")


def wait_for_end(pid: int) -> None:
    """Wait until a process has ended that another one has started."""
    with suppress(ProcessLookupError):
        handle = os.pidfd_open(pid)
        try:
            assert select.select([handle], [], [], 30.0)[0]
        finally:
            os.close(handle)


def equal(tmp_path: Path, tell: Callable[[Sequence[Recorder]], None], *, lockstep: bool) -> None:
    """Assert that the logs of both recorders are the same, byte for byte."""
    here, there = tmp_path / "here.mcap", tmp_path / "there.mcap"
    with Recorder(here, **ABOUT, lockstep=lockstep) as one, RecorderProcess(there, **ABOUT, lockstep=lockstep) as other:
        tell([one, other])
    assert here.read_bytes() == there.read_bytes()
    assert LogReader(there).size > 10_000


@pytest.mark.parametrize(
    "options", ["", pytest.param("&wire=can", marks=pytest.mark.slow), "&faults=drop:0.05,corrupt:0.02,jitter:0.01", "&signed"]
)
def test_a_run_gives_the_same_bytes_as_recorded_in_this_process(tmp_path: Path, options: str) -> None:
    key = SigningKey(bytes(range(32))) if options == "&signed" else None
    url = f"sim://junior?opponent=flat-light&seed=3{options.replace('&signed', '')}"

    def run(recorders: Sequence[Recorder]) -> None:
        with hil.connect(url, taps=recorders, signing_key=key) as junior:
            junior.arm()
            junior.drive(0.2, -0.2)
            junior.wait(2.0)

    equal(tmp_path, run, lockstep=True)


@pytest.mark.parametrize("lockstep", [True, False])
def test_everything_that_can_be_told_gives_the_same_bytes(tmp_path: Path, lockstep: bool) -> None:  # noqa: FBT001
    def tell(recorders: Sequence[Recorder]) -> None:
        for recorder in recorders:
            recorder.opened(Opening("memory:", "memory:", "mavlink", lockstep=lockstep, clock=0.25))
            recorder.note("series", "begun before any step")
            recorder.session_drawn(4711)
            recorder.metadata("robot", {"SPD_FAST": "1"})
            recorder.attachment("begun/advice.toml", bytes(range(256)) * 3000, media_type="application/toml")
            second = recorder.of_network("tcp://second")
            for number in range(300):
                step(recorder, number)
            met = Circumstances(
                inputs=(OperatorInput("key w", "1"), OperatorInput("suspend")),
                lost=LinkClosedError("memory:", "unplugged"),
                ended=LinkClosedError("memory:", "gone"),
                back="memory:2",
                news=("well again",),
                dropped=17,
            )
            recorder.step(3.0, [(2.99, b"a"), (3.0, b"bc")], met)
            second.step(3.0, [(3.0, b"x")], met)
            second.wire_rx(3.0, b"x")
            second.wire_tx(3.0, b"y")
            second.session_drawn(12)
            recorder.unsent(3.0, b"z", LinkTimeoutError("memory:", "full"))
            recorder.event(PeerFound(1, 3.0))
            recorder.event(PeerLost(1, 3.0, "unplugged"))
            recorder.event(LinkNews("odd", 3.0))
            recorder.sent(3.0, CommandLong(1, 1, Command.ARM_DISARM, param1=np.float64(1.0)))
            recorder.sent(3.0, JuniorWheels(7, np.uint16(1), (np.float64(1.0), -1), 0.25, 1, 1))  # type: ignore[arg-type]
            recorder.sent(3.0, SetupSigning(1, 1, tuple(range(32)), 5))
            odd = JuniorSensors(np.float64(1.5), (0.1, -0.1), (1, 2), (3, 4), 7.4, signal.Signals.SIGINT)
            recorder.received(Received(odd, 1, 1, 9, 3.0, b""))
            recorder.generation(GenerationRecord((1, 3), 2, 4, 320, 90, np.float64(21.5), 12.25, "FF FF"))
            recorder.advice({"version": 1, "entries": [{"b": 1, "a": (1, 2)}]})
            recorder.note("odd", "text", path=Path("a"), numbers={10: 1, 9: np.float64(2.0)}, nothing=float("nan"))
            recorder.flush()
            recorder.note("safety", "emergency stop", by="operator")

    equal(tmp_path, tell, lockstep=lockstep)


def test_a_key_never_leaves_this_process(tmp_path: Path) -> None:
    sent: list[bytes] = []
    recorder = RecorderProcess(tmp_path / "log.mcap", **ABOUT, lockstep=True)
    recorder.feed = LockstepFeed(lambda _, packed: sent.extend(packed))
    key = tuple(range(100, 132))
    recorder.step(1.0, [])
    recorder.sent(1.0, SetupSigning(1, 1, key, 5))
    recorder.received(Received(SetupSigning(1, 1, key, 5), 1, 1, 0, 1.0, bytes(key)))
    recorder.discard()
    assert b"".join(sent)
    assert bytes(key[:8]) not in b"".join(sent)
    assert str(key[:8])[1:-1] not in str([unpack(one) for one in sent])


def test_a_file_that_is_there_is_refused_before_anything_is_started(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hil.recording.pipe.subprocess.Popen", None)
    path = tmp_path / "log.mcap"
    path.write_bytes(b"mine")
    with pytest.raises(OutputExistsError, match="is there already"):
        RecorderProcess(path, **ABOUT, lockstep=True)
    with pytest.raises(LogError, match="cannot write the log"):
        RecorderProcess(path / "log.mcap", **ABOUT, lockstep=True)
    assert path.read_bytes() == b"mine"


def test_a_file_that_may_be_replaced_is_when_the_log_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    path.write_bytes(b"old")
    recorder = RecorderProcess(path, **ABOUT, lockstep=True, overwrite=True)
    step(recorder, 1)
    recorder.flush()
    assert path.read_bytes() == b"old"
    recorder.close()
    assert LogReader(path).health().startswith("whole") or list(LogReader(path).entries())
    assert list(tmp_path.iterdir()) == [path]


def test_a_log_that_is_not_wanted_leaves_no_file_and_no_process(tmp_path: Path) -> None:
    recorder = RecorderProcess(tmp_path / "log.mcap", **ABOUT, lockstep=False)
    process = recorder._pipe._process
    step(recorder, 1)
    recorder.discard()
    recorder.close()
    assert list(tmp_path.iterdir()) == []
    assert process.returncode == 0


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="no list of open files")
def test_nothing_stays_open(tmp_path: Path) -> None:
    RecorderProcess(tmp_path / "first.mcap", **ABOUT, lockstep=False).close()
    before, threads = len(list(Path("/proc/self/fd").iterdir())), threading.active_count()
    RecorderProcess(tmp_path / "log.mcap", **ABOUT, lockstep=False).close()
    assert len(list(Path("/proc/self/fd").iterdir())) == before
    assert threading.active_count() == threads


@posix
def test_signals_from_the_terminal_do_not_reach_it_and_polite_kills_do_not_end_it(tmp_path: Path) -> None:
    with RecorderProcess(tmp_path / "log.mcap", **ABOUT, lockstep=True) as recorder:
        for number in range(100):
            step(recorder, number)
        recorder.flush()  # it runs by now
        pid = recorder.pid
        assert os.getsid(pid) == pid != os.getsid(0)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGTSTP):
            os.kill(pid, number)
        step(recorder, 100)
    assert list(LogReader(tmp_path / "log.mcap").entries())[-1].time == 1.0


@posix
@pytest.mark.parametrize(
    ("steps", "lockstep"),
    [(130, True), (130, False), *(pytest.param(2900, mode, marks=pytest.mark.slow) for mode in (True, False))],
)
def test_a_process_that_is_killed_is_told_of_once_and_costs_a_second_at_most(
    tmp_path: Path,
    steps: int,
    lockstep: bool,  # noqa: FBT001
) -> None:
    path, told = tmp_path / "log.mcap", list[tuple[str, Path | None]]()
    recorder = RecorderProcess(path, **ABOUT, lockstep=lockstep, on_failure=lambda text, kept: told.append((text, kept)))
    for number in range(steps):
        step(recorder, number)
    if not lockstep:
        recorder.flush()  # log time runs faster here than the wall clock
    os.kill(recorder.pid, signal.SIGKILL)
    recorder._pipe._process.wait()
    recorder._pipe._listener.join()
    for number in range(steps, steps + 200):
        step(recorder, number)
    recorder.close()
    recorder.close()
    ((text, kept),) = told
    assert "was killed by signal 9" in text
    assert kept == path
    assert last_time(path) >= (steps - 1) * 0.01 - 1.0


@pytest.mark.skipif(not hasattr(os, "pidfd_open"), reason="no way to wait for a process that is not ours")
@pytest.mark.parametrize("steps", [130, pytest.param(1500, marks=pytest.mark.slow)])
def test_when_this_process_is_killed_the_log_is_finished(tmp_path: Path, steps: int) -> None:
    path = tmp_path / "log.mcap"
    program = (
        "import os, signal, sys; from pathlib import Path; from recordings import ABOUT, step; "
        "from hil.recording.process import RecorderProcess\n"
        f"recorder = RecorderProcess(Path({str(path)!r}), **ABOUT, lockstep=True)\n"
        f"for number in range({steps}): step(recorder, number)\n"
        "print(recorder.pid, flush=True)\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    support = str(Path(__file__).parent.parent / "support")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([support, *sys.path])}
    command = [sys.executable, "-c", program]
    ended = subprocess.run(command, check=False, capture_output=True, env=environment, timeout=60)  # noqa: S603 - our own
    assert ended.returncode == -signal.SIGKILL
    wait_for_end(int(ended.stdout))
    reader = LogReader(path)
    entries = list(reader.entries())
    assert not reader.truncated
    assert entries[-1].time >= (steps - 1) * 0.01 - 0.25


@posix
def test_a_disk_that_blocks_holds_up_no_step_and_what_is_lost_is_counted_told_and_recorded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(feeds, "QUEUE", 400)
    path, told = tmp_path / "fifo", list[str]()
    os.mkfifo(path)
    begin, content = threading.Event(), bytearray()

    def read() -> None:
        with path.open("rb") as file:
            begin.wait()
            while data := file.read(1 << 16):
                content.extend(data)

    reader = threading.Thread(target=read)
    reader.start()
    recorder = RecorderProcess(path, **ABOUT, lockstep=False, on_loss=told.append)
    dice, longest, number = np.random.default_rng(1), 0.0, 0
    while not recorder.feed.losing and number < 200_000:  # until the pipe, what is on its way, and the queue are full
        recorder.wire_rx(number * 0.01, dice.bytes(200))
        start = perf_counter()
        step(recorder, number)
        longest = max(longest, perf_counter() - start)
        number += 1
    for _ in range(50):
        step(recorder, number)
    assert recorder.feed.losing
    assert longest < 0.5  # the disk has taken nothing all the while
    begin.set()
    recorder.close()
    reader.join()
    assert recorder.lost > 100
    (text,) = told
    assert text.startswith(f"{recorder.lost:,} entries of the log were lost")
    log = tmp_path / "log.mcap"
    log.write_bytes(content)
    notes = [entry.value.text for entry in LogReader(log).entries(["/events"])]
    assert text in notes


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_full_disk_is_told_once() -> None:
    told: list[tuple[str, Path | None]] = []
    recorder = RecorderProcess(
        Path("/dev/full"), **ABOUT, lockstep=True, on_failure=lambda text, kept: told.append((text, kept))
    )
    for number in range(200):
        step(recorder, number)
    recorder.close()
    ((text, kept),) = told
    assert "No space left on device" in text
    assert kept is None
    with pytest.raises(LogError, match="No space left on device"):
        RecorderProcess(Path("/dev/full"), **ABOUT, lockstep=True).close()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_guests_are_told_when_the_log_is_written_no_further() -> None:
    told: list[str] = []
    share = LinkSharing(lambda *_: None, "127.0.0.1", 0, "coach")
    recorder = RecorderProcess(
        Path("/dev/full"), **ABOUT, lockstep=True, on_failure=lambda text, _: told.append(text), share=share
    )
    with Guest(int(recorder.shared.rpartition(":")[2])) as guest:
        for number in range(400):
            step(recorder, number)
        assert told
        recorder.close()
        guest.to_the_end()
    assert len(guest.of_kind(JuniorSensors)) == 400
    assert len(guest.of_kind(RobotAlive)) == 100


def test_a_batch_that_was_interrupted_is_taken_once() -> None:
    sent: list[tuple[int, list[bytes]]] = []
    strokes = [KeyboardInterrupt, None, KeyboardInterrupt, None]

    def send(number: int, packed: Sequence[bytes]) -> None:
        sent.append((number, list(packed)))
        if strokes and (stroke := strokes.pop(0)) is not None:
            raise stroke

    feed = LockstepFeed(send)
    for number in range(8):
        feed.add((0, number))
        try:
            feed.hurry()
        except KeyboardInterrupt:
            continue
    taken: dict[int, list[int]] = {}
    for number, packed in sent:
        taken[number] = [item[1] for one in packed for item in unpack(one)]  # again with its number, and more
    assert [one for numbers in taken.values() for one in numbers] == list(range(8))


def test_a_python_inside_another_program_writes_its_log_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/opt/game/game")
    with begin_log(tmp_path / "log.mcap", **ABOUT, lockstep=True) as recorder:
        assert type(recorder) is Recorder
