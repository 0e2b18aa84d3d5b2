"""Parameters from a file: all of it is checked, all of it is set and read back, or else all is put back."""

from __future__ import annotations

import struct
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st
from scripted_robot import ScriptedRobot

from firmware_protocol.errors import PeerError
from firmware_protocol.links import MemoryLink
from firmware_protocol.messages import ParamSet
from firmware_protocol.parameters import JUNIOR_PARAMETERS
from hil.bridge.bridge import Bridge
from hil.files.parameter_loading import KNOWN, ParameterLoadError, Wanted, check_file, load, shortest
from hil.sumo.junior import Junior

if TYPE_CHECKING:
    from collections.abc import Iterator

    from firmware_protocol.wire.fields import Message

START = {"SYS_ID": 3.0, "MEM_SLOTS": 32.0, "SPD_FAST": 1.0, "SPD_SLOW": 0.4, "EYE_L_ON": 250.0, "OWN_PART": 5.0}


def wanted(text: str, *, everything: bool = False) -> Wanted:
    return check_file(Path("my.toml"), text, tomllib.loads(text), everything=everything)


class Picky(ScriptedRobot):
    """A robot that may refuse, forget, or fall silent.

    Attributes:
        refuses: Parameters that it does not set.
        forgets: Parameters that it says to have set, and has not.
        deaf_from: Number of the setting from which on it is silent; 0: it never is.
        sets: What it was asked to set, once for each repetition.
    """

    def __init__(self) -> None:
        super().__init__(parameters=dict(START))
        self.refuses: set[str] = set()
        self.forgets: set[str] = set()
        self.deaf_from = 0
        self.sets: list[str] = []

    def _answer(self, message: Message) -> None:
        if not isinstance(message, ParamSet):
            super()._answer(message)
            return
        if not self.sets or self.sets[-1] != message.param_id:
            self.sets.append(message.param_id)
        self.silent = 0 < self.deaf_from <= len(self.sets)
        before = self.parameters[message.param_id]
        if message.param_id not in self.refuses and not self.silent:
            self.parameters[message.param_id] = message.param_value
        self._parameter(list(self.parameters).index(message.param_id))
        if message.param_id in self.forgets:
            self.parameters[message.param_id] = before


@pytest.fixture
def robot() -> Picky:
    return Picky()


@pytest.fixture
def junior(robot: Picky) -> Iterator[Junior]:
    sessions = iter(range(100, 200))
    with Junior(Bridge(MemoryLink(robot), robot, session=lambda: next(sessions))) as junior:
        junior.find()
        yield junior


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("SPD_FAST = 0.5\nSPD_SLOW = true\n", "my.toml, line 2: SPD_SLOW must be a number, not True"),
        ("\nSPD_FAST = '0.5'\n", "my.toml, line 2: SPD_FAST must be a number, not '0.5'"),
        ("[SPD_FAST]\nx = 1\n", "my.toml, line 1: SPD_FAST must be a number"),
        ("SPD_FAST = [1]\n", "must be a number"),
        ("SPD_FAST = 1.5\n", "my.toml, line 1: SPD_FAST must be 0 to 1, not 1.5"),
        ("EYE_L_ON = -1\n", "EYE_L_ON must be 0 to 1023 counts, not -1"),
        ("EYE_L_ON = 2.5\n", "EYE_L_ON must be a whole number, not 2.5"),
        ("SPD_FAST = nan\n", "must be a number that 32 bits hold"),
        ("OWN_PART = inf\n", "must be a number that 32 bits hold"),
        ("OWN_PART = 1e39\n", "must be a number that 32 bits hold"),
        ("SYS_ID = 0\n", "SYS_ID must be 1 to 254"),
        ("MEM_SLOTS = 'many'\n", "MEM_SLOTS must be a number"),
    ],
)
def test_what_no_robot_takes_is_found_before_there_is_one(text: str, said: str) -> None:
    with pytest.raises(ParameterLoadError) as caught:
        wanted(text)
    assert said in str(caught.value)


@pytest.mark.parametrize("document", [[1], "text", 3, None])
def test_what_is_no_table_is_said_to_be_none(document: object) -> None:
    with pytest.raises(ParameterLoadError, match="names and numbers"):
        check_file(Path("my.json"), "", document, everything=False)


def test_an_unknown_name_stops_all_before_anything_is_set(junior: Junior, robot: Picky) -> None:
    with pytest.raises(
        ParameterLoadError, match=r"my.toml, line 2: the robot has no parameter SPD_SLOWW\. Did you mean SPD_SLOW"
    ):
        load(junior, wanted("SPD_FAST = 0.5\nSPD_SLOWW = 0.3\n"), tell=print, warn=print)
    assert robot.parameters == START
    assert robot.sets == []


def test_what_differs_is_set_and_said_and_nothing_else(junior: Junior, robot: Picky) -> None:
    said: list[str] = []
    text = "SPD_FAST = 1.0\nSPD_SLOW = 0.3\nEYE_L_ON = 300\nOWN_PART = 5\n"
    result = load(junior, wanted(text), tell=said.append, warn=pytest.fail)
    assert robot.sets == ["SPD_SLOW", "EYE_L_ON"]
    assert said == ["changed: SPD_SLOW 0.4 -> 0.3", "changed: EYE_L_ON 250 -> 300"]
    assert result == pytest.approx({**START, "SPD_SLOW": 0.3, "EYE_L_ON": 300})
    said.clear()
    load(junior, wanted(text), tell=said.append, warn=pytest.fail)
    assert said == ["The robot has everything as in my.toml."]


def test_another_robots_id_and_what_only_the_firmware_sets_are_left_out(junior: Junior, robot: Picky) -> None:
    said: list[str] = []
    text = "SYS_ID = 7\nMEM_SLOTS = 16\nSPD_SLOW = 0.3\n"
    load(junior, wanted(text), tell=said.append, warn=pytest.fail)
    assert (robot.parameters["SYS_ID"], robot.parameters["MEM_SLOTS"]) == (3.0, 32.0)
    assert said[:2] == [
        "left out: SYS_ID, which tells robots apart (--all sets it too)",
        "left out: MEM_SLOTS = 16, which only the firmware sets; the robot has 32",
    ]
    load(junior, wanted(text, everything=True), tell=said.append, warn=pytest.fail)
    assert (robot.parameters["SYS_ID"], robot.parameters["MEM_SLOTS"]) == (7.0, 32.0)
    assert "changed: SYS_ID 3 -> 7" in said
    assert "MEM_SLOTS" not in robot.sets


THREE = "SPD_FAST = 0.9\nSPD_SLOW = 0.3\nEYE_L_ON = 300\n"


def test_what_was_set_is_put_back_when_one_is_refused(junior: Junior, robot: Picky) -> None:
    robot.refuses = {"EYE_L_ON"}
    said: list[str] = []
    with pytest.raises(ParameterLoadError, match=r"my.toml, line 3: .*EYE_L_ON to 300: it keeps 250"):
        load(junior, wanted(THREE), tell=pytest.fail, warn=said.append)
    assert robot.parameters == pytest.approx(START)
    assert said == ["Everything is as it was before."]


def test_what_is_not_so_when_read_back_is_put_back(junior: Junior, robot: Picky) -> None:
    robot.forgets = {"SPD_SLOW"}
    said: list[str] = []
    with pytest.raises(ParameterLoadError, match=r"my.toml, line 2: SPD_SLOW was set to 0.3, but the robot has 0.4"):
        load(junior, wanted(THREE), tell=pytest.fail, warn=said.append)
    assert robot.parameters == pytest.approx(START)
    assert said == ["Everything is as it was before."]


def test_what_can_not_be_put_back_is_listed(junior: Junior, robot: Picky) -> None:
    robot.deaf_from = 3
    said: list[str] = []
    with pytest.raises(PeerError):
        load(junior, wanted(THREE), tell=pytest.fail, warn=said.append)
    assert "Not everything could be put back" in said[0]
    assert [line.strip() for line in said[1:]] == ["SPD_FAST 1 -> 0.9", "SPD_SLOW 0.4 -> 0.3", "EYE_L_ON 250 -> 300"]


def test_an_interruption_puts_back_too(junior: Junior, robot: Picky, monkeypatch: pytest.MonkeyPatch) -> None:
    set_parameter = junior.set_parameter
    asked: list[str] = []

    def interrupted(name: str, value: float) -> float:
        asked.append(name)
        if len(asked) == 2:
            raise KeyboardInterrupt
        return set_parameter(name, value)

    monkeypatch.setattr(junior, "set_parameter", interrupted)
    with pytest.raises(KeyboardInterrupt):
        load(junior, wanted(THREE), tell=pytest.fail, warn=lambda _: None)
    assert robot.parameters == pytest.approx(START)


def singles() -> st.SearchStrategy[float]:
    return st.floats(width=32, allow_nan=False, allow_infinity=False)


@given(singles())
def test_what_is_saved_is_the_same_number_of_32_bits(value: float) -> None:
    text = tomli_w.dumps({"X": shortest(value)})
    assert struct.pack("<f", tomllib.loads(text)["X"]) == struct.pack("<f", value)


@pytest.mark.parametrize(
    ("value", "text"), [(0.3, "0.3"), (0.7, "0.7"), (250.0, "250"), (0.1234567, "0.1234567"), (1e-7, "1e-07"), (-0.0, "-0.0")]
)
def test_the_shortest_text_is_saved(value: float, text: str) -> None:
    single = struct.unpack("<f", struct.pack("<f", value))[0]
    assert tomli_w.dumps({"X": shortest(single)}) == f"X = {text}\n"


def test_every_default_is_one_that_a_file_may_hold() -> None:
    text = tomli_w.dumps({parameter.name: shortest(parameter.default) for parameter in JUNIOR_PARAMETERS})
    found = wanted(text, everything=True)
    assert {**found.values, **found.read_only} == {name: about.default for name, about in KNOWN.items()}
