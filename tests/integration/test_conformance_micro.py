"""The conformance suite on micro-robots: an emulated one keeps the protocol, and each broken firmware fails its one check."""

from __future__ import annotations

import json
from itertools import count
from typing import TYPE_CHECKING, Any, Final

import pytest
from can_mutants import CAN_MUTANTS
from host_mutants import HOST_MUTANTS
from micro_mutants import MICRO_MUTANTS, MicroMutant
from mutants import MUTANTS, Workshop

from firmware_protocol.links.memory import MemoryLink
from firmware_protocol.roles.swarm import MICRO_ROBOT
from firmware_protocol.wire.fields import CAN, MAVLINK
from hil.cli.app import run
from hil.conformance import CHECKS, LAST, CheckOutcome, Subject, for_role, on_wire, perform
from simdevice.kernel.swarm import SwarmArrays
from simdevice.swarm.settings import SwarmSettings
from simdevice.swarm.world import SwarmWorld

if TYPE_CHECKING:
    from pathlib import Path

    from mutants import Build, Mutant

    from hil.conformance import Check, Verdict

OF_MICRO: Final = [check for check in CHECKS if check.role == MICRO_ROBOT.name]
FOR_MICRO: Final = for_role(CHECKS, MICRO_ROBOT)
OF_OTHERS: Final = {check.name for check in CHECKS} - {check.name for check in FOR_MICRO}
FIX_TOLD: Final = {"fix-believed", "fix-of-other-session-ignored", "old-fix-ignored"}
"""What is seen of a robot that does not find its position itself."""
NEEDS_FIX: Final = {"own-fix-believed", *(check.name for check in OF_MICRO if check.second or "fence" in check.name)}
OWN_LINE: Final = {"bad-checksum-dropped", "unknown-message-counted", "impossible-length-refused"}
"""What is seen of a robot that has a line of its own."""
UNSEEN: Final = {"same-sequence-performs-once", "new-session-disarms", "good-transfers-counted"}
"""Checks whose mutant is wrong in what a Junior alone does: a maneuver, being driven by a session's host, wheels on CAN."""
_SEEN: Final = {check.name for check in FOR_MICRO} - UNSEEN
CORE: Final = [
    mutant
    for mutant in (*MUTANTS, *CAN_MUTANTS, *HOST_MUTANTS)
    if mutant.of_core and not mutant.keyed and mutant.caught_by in _SEEN
]
"""Faults of what every robot has."""
URL: Final = "sim://swarm?rangers=1&wilds=0"


def subject(world: SwarmWorld, *, second: int | None = None) -> Subject:
    numbers = count(4711)
    return Subject(MemoryLink(world, wire=world.wire), world, session=lambda: next(numbers), system=1, second=second)


def outcomes(verdicts: list[Verdict], outcome: CheckOutcome) -> dict[str, str]:
    return {verdict.check.name: verdict.detail for verdict in verdicts if verdict.outcome is outcome}


# --- the emulated robot ----------------------------------------------------------------------------------------------


def test_an_emulated_robot_passes_and_no_wheel_turns_unasked(monkeypatch: pytest.MonkeyPatch) -> None:
    efforts: list[tuple[int, int]] = []
    live = SwarmArrays.run

    def watched(arrays: SwarmArrays, periods: int) -> Any:  # noqa: ANN401 - what it returns
        life = live(arrays, periods)
        wheels = arrays.loop.robot[0].io.wheel
        efforts.append((wheels[0], wheels[1]))
        return life

    monkeypatch.setattr(SwarmArrays, "run", watched)
    robot = subject(SwarmWorld(SwarmSettings(rangers=1, wilds=0)))
    robot.greet()
    verdicts = perform(robot, on_wire(CHECKS, MAVLINK), LAST)
    assert outcomes(verdicts, CheckOutcome.FAILED) == {}
    assert set(efforts) == {(0, 0)}, "without --moving no wheel was ever given any effort"
    assert set(outcomes(verdicts, CheckOutcome.OTHER_ROLE).values()) == {"not for this role"}
    not_run = outcomes(verdicts, CheckOutcome.NOT_RUN)
    turning = {check.name for check in on_wire(FOR_MICRO, MAVLINK) if check.turns(stands=False)}
    assert {name for name, why in not_run.items() if why.startswith("turns the wheels")} == turning
    assert not_run["move-arrives"] == "turns the wheels and needs 0.15 m of free room around it: --moving"


@pytest.mark.slow
@pytest.mark.parametrize("fixes", [True, False])
@pytest.mark.parametrize("wire", [MAVLINK, CAN])
@pytest.mark.parametrize("seed", [1, 2])
def test_two_robots_pass_all_there_is(seed: int, wire: str, *, fixes: bool) -> None:
    world = SwarmWorld(SwarmSettings(rangers=1, wilds=1, seed=seed, wire=wire, fixes=fixes))
    robot = subject(world, second=2)
    robot.greet()
    verdicts = perform(robot, [check for check in on_wire(FOR_MICRO, wire) if not check.keyed], LAST, moving=True)
    assert outcomes(verdicts, CheckOutcome.FAILED) == {}
    not_run = outcomes(verdicts, CheckOutcome.NOT_RUN)
    assert {name for name in not_run if name in FIX_TOLD | NEEDS_FIX} == (FIX_TOLD if fixes else NEEDS_FIX)
    rest = {name for name in not_run if name not in FIX_TOLD | NEEDS_FIX}
    assert rest == (OWN_LINE if wire == MAVLINK else {name for name, why in not_run.items() if why == "a bus has no source"})


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_where_no_table_is_heard_it_drives_to_the_second_robot(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hil.conformance.probe.table_system", lambda _: 0)
    robot = subject(SwarmWorld(SwarmSettings(rangers=1, wilds=1, seed=seed)), second=2)
    robot.greet()
    pairs = [check for check in OF_MICRO if check.second]
    verdicts = perform(robot, pairs, LAST, moving=True)
    assert not robot.table
    assert set(outcomes(verdicts, CheckOutcome.PASSED)) == {LAST.name, *(check.name for check in pairs)}, verdicts


def test_it_is_left_as_it_was_found() -> None:
    world = SwarmWorld(SwarmSettings(rangers=1, wilds=0))
    robot = subject(world)
    robot.greet()
    robot.set_parameter("SENSE_R0", 0.375)
    found = {value.param_id: value.param_value for value in robot.list_parameters()}
    robot.parameters_found = found
    perform(robot, [check for check in OF_MICRO if not check.turns(stands=False)], LAST)
    robot.spend(0.1)
    assert {value.param_id: value.param_value for value in robot.list_parameters()} == found
    assert robot.observe().radius >= 0.375, "SWARM_SENSE is forgotten: it has restarted"
    assert not robot.told_to_sense


def test_each_rule_of_a_micro_robot_has_a_broken_firmware() -> None:
    assert sorted(mutant.caught_by for mutant in MICRO_MUTANTS) == sorted(check.name for check in OF_MICRO)


# --- broken firmwares ------------------------------------------------------------------------------------------------


@pytest.fixture(scope="session")
def builds(tmp_path_factory: pytest.TempPathFactory) -> dict[Mutant, Build]:
    """All mutants, built."""
    mutants = (*MICRO_MUTANTS, *CORE)
    made = Workshop(tmp_path_factory.mktemp("micro_mutants"), kernel=True).build(mutants)
    return dict(zip(mutants, made, strict=True))


def failed(build: Build, monkeypatch: pytest.MonkeyPatch, checks: list[Check], settings: SwarmSettings) -> list[str]:
    for module in ("world", "table"):
        monkeypatch.setattr(f"simdevice.swarm.{module}.board_host", lambda: build)
    robot = subject(SwarmWorld(settings), second=2 if settings.count > 1 else None)
    robot.greet()
    return list(outcomes(perform(robot, checks, LAST, moving=True), CheckOutcome.FAILED))


@pytest.mark.slow
@pytest.mark.parametrize("mutant", MICRO_MUTANTS, ids=lambda mutant: mutant.caught_by)
def test_a_broken_firmware_fails_the_check_that_names_its_fault_and_no_other(
    mutant: MicroMutant, builds: dict[Mutant, Build], monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = SwarmSettings(rangers=1, wilds=1, wire=mutant.wire, fixes=mutant.fixes)
    assert failed(builds[mutant], monkeypatch, FOR_MICRO, settings) == [mutant.caught_by], f"it {mutant.fault}"


@pytest.mark.slow
@pytest.mark.parametrize("mutant", CORE, ids=lambda mutant: f"{mutant.wire}-{mutant.caught_by}")
def test_a_fault_of_the_core_is_found_in_a_micro_robot_too(
    mutant: Mutant, builds: dict[Mutant, Build], monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = SwarmSettings(rangers=1, wilds=0, wire=mutant.wire)
    assert mutant.caught_by in failed(builds[mutant], monkeypatch, FOR_MICRO, settings), f"it {mutant.fault}"


# --- the command -----------------------------------------------------------------------------------------------------


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    return tmp_path


def test_what_is_for_a_junior_says_so_and_is_counted_apart(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", URL]) == 0
    *rows, summary = capsys.readouterr().out.splitlines()
    others = [row.split()[0] for row in rows if row.endswith("not for this role")]
    assert "contest-countdown" in others
    assert summary.endswith(f", {len(others)} not for this role")
    assert run(["check", "--json", "--only", "move-arrives", "--only", "watchdog-stops"]) == 0
    verdicts = {verdict["name"]: verdict for verdict in json.loads(capsys.readouterr().out)}
    assert verdicts["move-arrives"] == {"name": "move-arrives", "passed": None, "detail": "not for this role"}
    assert verdicts["watchdog-stops"]["passed"]


def test_a_second_robot_is_named_by_its_address(capsys: pytest.CaptureFixture[str]) -> None:
    two = "sim://swarm?rangers=1&wilds=1"
    wanted = ["--moving", "--no-log", "--only", "move-blocked-by-contact"]
    assert run(["check", two, *wanted]) == 0
    assert "needs a second robot: --with ADDRESS" in capsys.readouterr().out
    for address in ("2", "1.2"):
        assert run(["check", two, *wanted, "--with", address]) == 0
        assert "2 passed" in capsys.readouterr().out
    assert run(["check", URL, *wanted, "--with", "2"]) == 0
    assert "did not place robot 2" in capsys.readouterr().out


def test_a_second_robot_that_is_the_first(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", URL, "--with", "1"]) == 3
    assert "robot 1 is the one that is checked: name another one beside it" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--with", "2.1"], "write the system id of another robot"),
        (["--with", "255"], "write the system id of another robot"),
        (["--with", "1", "--system", "1"], "that is the robot that is checked"),
    ],
)
def test_a_second_robot_that_cannot_be(arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", URL, *arguments]) == 2
    assert said in capsys.readouterr().err


def test_a_check_of_a_micro_robot_replays(capsys: pytest.CaptureFixture[str]) -> None:
    wanted = ["--only", "counts-before-and-after", "--only", "move-arrives", "--only", "watcher-moves-nothing"]
    two = "sim://swarm?rangers=1&wilds=1"
    assert run(["check", two, "--moving", "--with", "2", "--log", "log.mcap", *wanted]) == 0
    assert run(["replay", "log.mcap"]) == 0
    assert "difference" not in capsys.readouterr().err
