"""A log is not trusted: what it names is not opened, and what it asks for is done within the replay, or refused in words."""

from __future__ import annotations

import builtins
import io
import json
import os
import socket
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NoReturn

import can
import pytest
import serial
from edited_logs import STEP, TX, EditedLog
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import hil
from hil.cli.app import run as run_hil
from hil.mcaplog.errors import LogError
from hil.replaying.host import JOBS
from hil.replaying.tape import ReplayError

if TYPE_CHECKING:
    from collections.abc import Callable

LOGS: Final = Path(__file__).parents[1] / "replay_logs"
PYTHON: Final = (sys.prefix, sys.base_prefix)
"""Where Python and its packages are, which it loads when they are first used."""
ELSEWHERE: Final = "/etc/passwd"
DEVICE: Final = "serial:///dev/ttyACM0:115200"


@pytest.fixture
def small() -> EditedLog:
    """A log that can be replayed."""
    return EditedLog.of(LOGS / "interrupted.mcap")


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What is opened, but for Python's own modules: files, sockets, serial ports, buses, processes."""
    seen: list[str] = []

    def watched(real: Callable[..., object]) -> Callable[..., object]:
        def opener(name: int | str | os.PathLike[str], *args: object, **options: object) -> object:
            if not isinstance(name, int) and not os.fspath(name).startswith(PYTHON) and not os.fspath(name).endswith(".py"):
                seen.append(os.fspath(name))
            return real(name, *args, **options)

        return opener

    def refused(*args: object, **_: object) -> NoReturn:
        seen.append(str(args))
        raise AssertionError(args)

    monkeypatch.setattr(builtins, "open", watched(builtins.open))
    monkeypatch.setattr(io, "open", watched(io.open))
    monkeypatch.setattr(os, "open", watched(os.open))
    for module, name in ((socket, "socket"), (serial, "Serial"), (can, "Bus"), (subprocess, "Popen"), (os, "system")):
        monkeypatch.setattr(module, name, refused)
    return seen


def outcome(path: Path, *, strict: bool = False) -> hil.ReplayReport | str:
    """What comes of a replay, or the words in which it is refused, which are few; nothing else may come."""
    try:
        report = hil.replay(path, strict=strict)
    except (ReplayError, LogError) as error:
        text = str(error)
    else:
        assert str(report)
        return report
    assert len(text) < 1000
    return text


def asked(log: EditedLog, **config: str) -> EditedLog:
    """A log that asks for something else."""
    log.metadata["config"].update(config)
    return log


def renamed(log: EditedLog, link: str) -> EditedLog:
    """A log whose network has another address, in every entry of the bridge."""
    for place, entry in enumerate(log.entries):
        if entry.topic in {STEP, "/bridge/session"}:
            log.change(place, network=link)
        elif entry.topic == "/bridge/open":
            log.change(place, network=link, link=link)
        elif entry.topic.startswith("/wire/") and entry.topic != "/wire/rejected":
            log.change(place, link=link)
    return asked(log, link=link)


@pytest.mark.parametrize(
    "link",
    [
        DEVICE,
        f"{DEVICE}?faults=@{ELSEWHERE}",
        "tcp://127.0.0.1:5760",
        f"tcp://127.0.0.1:5760?faults=@{ELSEWHERE}",
        "udpin://0.0.0.0:14550",
        "can://socketcan/can0",
        "can://slcan//dev/ttyACM0",
        f"replay://{LOGS / 'pty.mcap'}",
        "sim://junior?board=another",
    ],
)
def test_a_link_that_a_log_names_is_looked_up_in_the_log(
    link: str, small: EditedLog, opened: list[str], tmp_path: Path
) -> None:
    """Nothing is opened by the addresses of a log; what it has of them is replayed as from any other."""
    log = renamed(small, link).write(tmp_path / "log.mcap")
    opened.clear()
    came = outcome(log)
    assert not isinstance(came, str) or str(log) in came
    assert set(opened) <= {str(log)}


def test_a_log_that_asks_for_all_of_them(
    small: EditedLog, opened: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Paths wherever one can stand: link, fault file, checkpoint, advice, option file, log, output, key."""
    options = json.loads(small.metadata["config"]["options"])
    options |= dict.fromkeys(("checkpoint", "advice_out", "resume_from", "log", "out", "config", "signing_key"), ELSEWHERE)
    log = renamed(small, f"{DEVICE}?faults=@{ELSEWHERE}")
    log = asked(log, options=json.dumps(options), faults=f"@{ELSEWHERE}", signing_key=ELSEWHERE, checkpoint=ELSEWHERE)
    log.attachments |= {f"begin/../../..{ELSEWHERE}": b"x", "begin/options.toml": b'log = "/etc/passwd"', "end/../x": b""}
    path = log.write(tmp_path / "log.mcap")
    opened.clear()
    assert run_hil(["replay", str(path)]) == 2
    said = capsys.readouterr()
    assert "does not say properly what was asked for" in " ".join(said.err.split())
    assert set(opened) <= {str(path)}
    assert [file.name for file in tmp_path.iterdir()] == ["log.mcap"]


def test_a_replay_writes_nothing_and_opens_nothing_but_the_log(opened: list[str], tmp_path: Path) -> None:
    for name in ("lockstep", "resumed", "bout", "extra_monitor", "extra_check"):
        before = sorted(tmp_path.rglob("*"))
        opened.clear()
        assert hil.replay(LOGS / f"{name}.mcap", strict=True).same
        assert set(opened) <= {str(LOGS / f"{name}.mcap")}, name
        assert sorted(tmp_path.rglob("*")) == before


WILD: Final[list[object]] = [
    None, True, -1, 0, 10**30, 1.5, float("inf"), float("nan"), "", "x" * 10_000, [], {}, [[[[]]]], {"at": ELSEWHERE},
]  # fmt: skip


@pytest.mark.parametrize("field", ["settings", "choose_objective", "opponent", "held_out", "seed", "reconnect", "unknown"])
@pytest.mark.parametrize("value", WILD, ids=lambda value: repr(value)[:12])
def test_wild_options_are_refused_or_decide_otherwise(field: str, value: object, small: EditedLog, tmp_path: Path) -> None:
    options = {**json.loads(small.metadata["config"]["options"]), field: value}
    outcome(asked(small, options=json.dumps(options)).write(tmp_path / "log.mcap"))


@pytest.mark.parametrize("text", ["", "{", "[]", "null", "1", "[" * 100_000, '{"settings": ' * 5000, '{"seed": 1e999}', "NaN"])
def test_options_that_are_none(text: str, small: EditedLog, tmp_path: Path) -> None:
    with pytest.raises(ReplayError, match="does not say"):
        hil.replay(asked(small, options=text).write(tmp_path / "log.mcap"))


@pytest.mark.parametrize(
    "verb", ["", "emulate", "keygen", "replay", "log", "../coach", "coach ", "Coach", "os.system", "x" * 5000]
)
def test_verbs_that_are_none(verb: str, small: EditedLog, tmp_path: Path) -> None:
    with pytest.raises(ReplayError, match="can be replayed") as refusal:
        hil.replay(asked(small, verb=verb).write(tmp_path / "log.mcap"))
    assert len(str(refusal.value)) < 600


@pytest.mark.parametrize("verb", sorted(JOBS.keys() - {"coach"}))
def test_another_verb_than_was_run(verb: str, small: EditedLog, tmp_path: Path) -> None:
    with pytest.raises(ReplayError, match="does not say properly"):
        hil.replay(asked(small, verb=verb).write(tmp_path / "log.mcap"))


@pytest.mark.parametrize("faults", ["@/etc/passwd", "drop", "drop:2", "nonsense:1", "drop:0.1," * 10_000, "unplug:1e300"])
def test_faults_that_are_none(faults: str, small: EditedLog, opened: list[str], tmp_path: Path) -> None:
    log = asked(small, faults=faults).write(tmp_path / "log.mcap")
    opened.clear()
    with pytest.raises(ReplayError, match="does not say properly"):
        hil.replay(log)
    assert set(opened) <= {str(log)}


@pytest.mark.parametrize(
    "data",
    [b"", b"\0" * 1000, b"{", b"[" * 100_000, b"{}", b'{"version": 99}', "ä".encode("latin-1"), b"x" * 3_000_000],
    ids=["empty", "zeros", "open", "deep", "nothing", "version", "encoding", "huge"],
)
def test_a_checkpoint_that_is_none(data: bytes, tmp_path: Path) -> None:
    log = EditedLog.of(LOGS / "resumed.mcap")
    log.attachments["begin/checkpoint.json"] = data
    came = outcome(log.write(tmp_path / "log.mcap"))
    assert isinstance(came, str) or not came.same


@pytest.mark.parametrize("data", [b"", b"\0", b"[[[", b"a = 1", b"\xff", b"[entries]\n" * 100_000])
def test_an_advice_that_is_none(data: bytes, tmp_path: Path) -> None:
    log = EditedLog.of(LOGS / "bout.mcap")
    log.attachments["begin/advice.toml"] = data
    with pytest.raises(ReplayError, match="does not say properly"):
        hil.replay(log.write(tmp_path / "log.mcap"))
    del log.attachments["begin/advice.toml"]
    with pytest.raises(ReplayError, match=r"advice\.toml"):
        hil.replay(log.write(tmp_path / "other.mcap"))


def test_an_attachment_that_is_huge(small: EditedLog, tmp_path: Path) -> None:
    small.attachments["begin/more"] = bytes(64 << 20)
    assert "--max-chunk" in str(outcome(small.write(tmp_path / "log.mcap")))


@pytest.mark.parametrize(
    "changes",
    [
        {"wire": "carrier pigeon"},
        {"wire": ""},
        {"wire": "can"},
        {"lockstep": True},
        {"clock": float("nan")},
        {"clock": float("inf")},
        {"clock": -1e300},
        {"link": "nonsense"},
        {"link": ""},
        {"signing_time": 2**63 - 1},
    ],
    ids=str,
)
def test_an_opening_that_can_not_be(changes: dict[str, Any], small: EditedLog, tmp_path: Path) -> None:
    small.change(small.places("/bridge/open")[0], **changes)
    survives(small, tmp_path)


def survives(log: EditedLog, folder: Path) -> None:
    """It comes out the same or otherwise, or is refused in words: nothing else."""
    for strict in (False, True):
        outcome(log.write(folder / "log.mcap"), strict=strict)


@pytest.mark.parametrize(
    "changes",
    [
        {"clock": float("nan")},
        {"clock": float("inf")},
        {"clock": float("-inf")},
        {"clock": 1e300},
        {"clock": 0.0},
        {"chunk_times": (1.0, 2.0), "chunk_sizes": (1,)},
        {"chunk_times": (float("nan"),), "chunk_sizes": (2**62,)},
        {"chunk_times": (1.0,), "chunk_sizes": (2**62,)},
        {"chunk_times": (1.0,), "chunk_sizes": (-1,)},
        {"chunk_times": (1.0,) * 1000, "chunk_sizes": (0,) * 1000},
        {"inputs": ("interrupt",), "input_robots": ()},
        {"inputs": ("interrupted",), "input_robots": ("",)},
        {"inputs": ("suspend", "continue", "key q", "nonsense", ""), "input_robots": ("",) * 5},
        {"inputs": ("suspend",) * 1000, "input_robots": ("",) * 1000},
        {"lost": "gone", "lost_link": "tcp://x"},
        {"back": "serial:///dev/ttyACM0:115200"},
        {"back": "nonsense"},
        {"ended": "gone", "ended_link": "x"},
        {"news": ("x" * 100_000,)},
        {"dropped": 2**63 - 1},
        {"dropped": -5},
        {"network": "another"},
    ],
    ids=lambda changes: str(changes)[:40],
)
def test_a_step_that_can_not_be(changes: dict[str, Any], small: EditedLog, tmp_path: Path) -> None:
    place = small.places(STEP)[200]
    small.change(place, **changes)
    survives(small, tmp_path)


@pytest.mark.parametrize("number", [0, -1, 2**16, 2**63 - 1])
def test_a_session_number_that_can_not_be(number: int, small: EditedLog, tmp_path: Path) -> None:
    for place in small.places("/bridge/session"):
        small.change(place, number=number)
    survives(small, tmp_path)


@cache
def interrupted() -> EditedLog:
    """A small log."""
    return EditedLog.of(LOGS / "interrupted.mcap")


@pytest.mark.nightly
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_bytes_of_entries_that_are_changed_at_random(data: st.DataObject, tmp_path: Path) -> None:
    """Whatever the bytes are that decide: a difference, a refusal, or no difference; never anything else."""
    log = EditedLog(list(interrupted().entries), interrupted().metadata, interrupted().attachments)
    topics = ["/bridge/open", "/bridge/session", STEP, "/wire/rx", TX, "/events", "/pal/decision", "/pal/trial"]
    places = log.places(data.draw(st.sampled_from(topics)))
    place = places[data.draw(st.integers(0, len(places) - 1))]
    entry = log.entries[place]
    changed = bytearray(entry.data)
    for _ in range(data.draw(st.integers(1, 3))):
        changed[data.draw(st.integers(0, len(changed) - 1))] ^= 1 << data.draw(st.integers(0, 7))
    log.entries[place] = type(entry)(entry.topic, entry.schema, entry.encoding, entry.log_time, bytes(changed))
    survives(log, tmp_path)
