"""The conformance suite: the emulated robot keeps the protocol, and each broken firmware fails the one check that names it."""

from __future__ import annotations

import dataclasses
import json
import signal
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pytest
from can_mutants import CAN_MUTANTS
from host_mutants import HOST_MUTANTS, NEED_SOURCES
from mutants import MUTANTS, Mutant, Workshop
from serving import MULTICAST, served
from signed_pair import KEY

from firmware_protocol.address import parse_address
from firmware_protocol.links.memory import MemoryLink
from firmware_protocol.messages import JuniorMemoryEntry, ParamValue, State
from firmware_protocol.roles.junior import JUNIOR
from firmware_protocol.vocabulary import Action
from firmware_protocol.wire.fields import CAN, MAVLINK
from firmware_protocol.wire.signing import Signing, virtual_time
from hil.cli.app import run
from hil.conformance import CHECKS, LAST, CheckOutcome, Subject, for_role, on_wire, perform
from hil.connecting.connecting import DEFAULT_URL, AddressOpener
from hil.mcaplog import LogReader
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from mutants import Build

    from firmware_protocol.link import Link
    from firmware_protocol.wire.signing import SigningKey
    from hil.conformance import Verdict
    from simdevice.sumo.world import World

ON_BYTES: Final = on_wire(CHECKS, MAVLINK)
NAMES: Final = [check.name for check in ON_BYTES]
OF_JUNIOR: Final = for_role(CHECKS, JUNIOR)
"""What can be checked on one."""
OTHERS: Final = [check.name for check in ON_BYTES if check not in OF_JUNIOR]
STILL: Final = [check.name for check in ON_BYTES if check in OF_JUNIOR and not check.moving and not check.keyed]
WITHOUT_KEY: Final = [check for check in OF_JUNIOR if not check.keyed]
NEAR_KEYS: Final = [check for check in CHECKS if check.group in {"signing", "framing", "stopping", "answers", "who may drive"}]
"""What a fault in signing could show up in."""
EVERY_MUTANT: Final = (*MUTANTS, *CAN_MUTANTS, *HOST_MUTANTS)
TAUGHT: Final = {(255, 0): (Action.L,), (255, 3): (Action.FF, Action.FF), (2, 1): (Action.LSRF, Action.SF, Action.SF)}
SET: Final = {"SPD_FAST": 0.9, "WATCHDOG": 400.0, "EYE_L_ON": 200.0, "STIM_ARMS": 1.0}


def subject(world: World, key: SigningKey | None = None) -> Subject:
    numbers = count(4711)
    signing = None if key is None else Signing(key, lambda: virtual_time(world.now()))
    return Subject(MemoryLink(world, wire=world.wire), world, session=lambda: next(numbers), signing=signing)


def failed(verdicts: list[Verdict]) -> list[str]:
    return [verdict.check.name for verdict in verdicts if verdict.outcome is CheckOutcome.FAILED]


class Watched:
    """A world that remembers whether a wheel was ever commanded."""

    def __init__(self, world: World) -> None:
        self._world = world
        self.turned = 0

    def now(self) -> float:
        return self._world.now()

    def step(self, inbound: bytes) -> bytes:
        out = self._world.step(inbound)
        self.turned += self._world.device.wheels != (0.0, 0.0)
        return out


# --- the emulated robot ----------------------------------------------------------------------------------------------


def test_the_emulated_robot_passes_and_no_wheel_turns_unasked() -> None:
    world = junior_world()
    watched = Watched(world)
    numbers = count(1)
    robot = Subject(MemoryLink(watched), watched, session=lambda: next(numbers))
    robot.greet()
    verdicts = perform(robot, ON_BYTES, LAST)
    assert failed(verdicts) == []
    assert watched.turned == 0, "without --moving no wheel was ever given any effort"
    assert [verdict.check.name for verdict in verdicts if verdict.outcome is CheckOutcome.PASSED] == [*STILL, LAST.name]


@pytest.mark.slow
@pytest.mark.parametrize("wire", [MAVLINK, CAN])
@pytest.mark.parametrize(("seed", "opponent"), [(1, "flat-light"), (2, "flat-heavy"), (3, "point-light")])
def test_it_passes_moving_wherever_it_stands(seed: int, opponent: str, wire: str) -> None:
    world = junior_world(WorldSettings(seed=seed, opponent=opponent, referee=seed != 2, wire=wire))
    robot = subject(world)
    robot.greet()
    told: list[Verdict] = []
    verdicts = perform(robot, on_wire(WITHOUT_KEY, wire), LAST, moving=True, told=told.append)
    assert failed(verdicts) == []
    not_run = {verdict.check.name: verdict.detail for verdict in verdicts if verdict.outcome is CheckOutcome.NOT_RUN}
    assert not_run == (dict.fromkeys(NEED_SOURCES, "a bus has no source") if wire == CAN else {})
    assert told == verdicts
    assert world.device.wheels == (0.0, 0.0)


def contents(nvm: bytes) -> tuple[list[ParamValue], list[JuniorMemoryEntry]]:
    """What a robot with this EEPROM says that it holds."""
    robot = subject(junior_world(WorldSettings(nvm=nvm)))
    robot.greet()
    entries = [dataclasses.replace(entry, session=0, sequence=0) for entry in robot.read_memory()]
    return robot.list_parameters(), entries


def taught() -> bytes:
    """The EEPROM of a robot that has been used: parameters set, maneuvers stored."""
    world = junior_world()
    robot = subject(world)
    robot.greet()
    for name, value in SET.items():
        robot.set_parameter(name, value)
    for (previous, current), actions in TAUGHT.items():
        assert robot.request(robot.write(actions, current, previous, period=0.2, options=5)) == 0
    robot.spend(0.1)
    return world.device.nvm


def test_parameters_and_memory_are_left_as_they_were_found() -> None:
    nvm = taught()
    world = junior_world(WorldSettings(nvm=nvm))
    robot = subject(world)
    robot.greet()
    verdicts = perform(robot, CHECKS, LAST, moving=True)
    assert failed(verdicts) == []
    robot.spend(0.1)
    after = world.device.nvm
    parameters, memory = contents(nvm)
    assert {value.param_id: value.param_value for value in parameters}["WATCHDOG"] == 400.0
    assert len(memory) == len(TAUGHT)
    assert contents(after) == (parameters, memory), "every value and every slot, checksum included"


def test_an_interrupted_run_leaves_the_robot_as_it_was_found() -> None:
    nvm = taught()
    world = junior_world(WorldSettings(nvm=nvm))
    robot = subject(world)
    robot.greet()
    send, left = robot._link.write, count(400)

    def write(data: bytes) -> None:
        if next(left) == 2500:
            raise KeyboardInterrupt
        send(data)

    robot._link.write = write  # type: ignore[method-assign]
    with pytest.raises(KeyboardInterrupt):
        perform(robot, CHECKS, LAST, moving=True)
    robot.spend(0.1)
    assert robot.state() == State.DISARMED
    assert world.device.wheels == (0.0, 0.0)
    assert contents(world.device.nvm) == contents(nvm)


def test_checks_have_names_demands_and_rules_of_the_protocol_page() -> None:
    page = (Path(__file__).parents[2] / "docs" / "protocol.md").read_text(encoding="utf-8")
    names = [check.name for check in (*CHECKS, LAST)]
    assert len(set(names)) == len(names) >= 120
    for check in (*CHECKS, LAST):
        assert check.name.replace("-", "").isalnum()
        assert check.name == check.name.lower()
        assert check.demands.endswith(".")
        assert check.rule in page, f"{check.name}: the protocol page has no {check.rule!r}"
        assert all(names.index(need) < names.index(check.name) for need in check.needs)


def test_a_robot_that_is_heard_before_its_heartbeat_is_not_another_one() -> None:
    world = junior_world(WorldSettings(referee=False))
    robot = subject(world)
    while world.now() < 0.5:
        world.step(b"")  # its first heartbeat goes by unheard
    robot.greet()
    assert (robot.system, robot.others) == (1, set())


def test_what_rests_on_a_failed_check_is_not_run() -> None:
    robot = subject(junior_world())
    robot.greet()

    def refuse(_: Subject) -> str:
        robot.expect_state(State.READY, "though nobody armed it")
        return ""

    first = dataclasses.replace(WITHOUT_KEY[0], run=refuse)
    second = dataclasses.replace(WITHOUT_KEY[1], needs=(first.name,))
    verdicts = perform(robot, [first, second], LAST)
    assert [verdict.outcome for verdict in verdicts] == [CheckOutcome.FAILED, CheckOutcome.NOT_RUN, CheckOutcome.PASSED]
    assert verdicts[0].detail == "though nobody armed it it is DISARMED, not READY"
    assert first.name in verdicts[1].detail


# --- broken firmwares ------------------------------------------------------------------------------------------------


@pytest.fixture(scope="session")
def builds(tmp_path_factory: pytest.TempPathFactory) -> dict[Mutant, Build]:
    """All mutants, built."""
    made = Workshop(tmp_path_factory.mktemp("mutants")).build(EVERY_MUTANT)
    return dict(zip(EVERY_MUTANT, made, strict=True))


@pytest.mark.slow
@pytest.mark.parametrize("mutant", EVERY_MUTANT, ids=lambda mutant: f"{mutant.wire}-{mutant.caught_by}")
def test_a_broken_firmware_fails_the_check_that_names_its_fault_and_no_other(
    mutant: Mutant, builds: dict[Mutant, Build]
) -> None:
    key = KEY if mutant.keyed else None
    robot = subject(junior_world(WorldSettings(host=builds[mutant], wire=mutant.wire, signing_key=key)), key)
    robot.greet()
    assert failed(perform(robot, NEAR_KEYS if mutant.keyed else CHECKS, LAST, moving=True)) == [mutant.caught_by], (
        f"it {mutant.fault}"
    )


# --- the command -----------------------------------------------------------------------------------------------------


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    return tmp_path


def test_the_command_prints_a_table_and_moves_only_when_told(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    assert run(["check"]) == 0
    lines = capsys.readouterr().out.splitlines()
    rows = {line.split()[0]: line for line in lines[:-1]}
    assert list(rows) == [*NAMES, LAST.name]
    assert "not run" in rows["stick-turns-wheels"]
    assert "after 250 ms" in rows["watchdog-stops"]
    not_run = len(NAMES) - len(STILL) - len(OTHERS)
    assert lines[-1] == f"{len(STILL) + 1} passed, {not_run} not run, {len(OTHERS)} not for this role"
    assert list(folder.iterdir()) == [], "what moves nothing leaves no log unless asked"


def test_a_bad_line_is_told_and_the_robot_is_put_back_all_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    wanted = ["--only", "parameters-take-their-limits", "--only", "memory-checksum", "--only", "frames-numbered"]
    assert run(["check", "sim://junior?faults=drop:0.1&seed=3", "--quiet", *wanted]) == 1
    said = capsys.readouterr().out
    assert "gaps in the numbers" in said
    assert "frames were lost" in said
    assert LAST.name not in said, "it did not fail"


def test_json_names_every_check(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", "--json", "--only", "stick-turns-wheels", "--only", "watchdog-stops"]) == 0
    first, second, third = json.loads(capsys.readouterr().out)
    assert first == {"name": "watchdog-stops", "passed": True, "detail": "after 250 ms"}
    assert (second["name"], second["passed"]) == ("stick-turns-wheels", None)
    assert (third["name"], third["passed"]) == (LAST.name, True)


def test_a_moving_run_is_logged(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", "--moving", "--only", "wheels-turn-as-told", "--quiet"]) == 0
    assert capsys.readouterr().out == "2 passed\n"
    (log,) = Path("runs").glob("*-check-emulated/log.mcap")
    assert list(LogReader(log).entries({"/junior/wheels"}))


@pytest.mark.slow
def test_a_failed_check_is_the_exit_status(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, builds: dict[Mutant, Build]
) -> None:
    (mutant,) = (mutant for mutant in MUTANTS if mutant.caught_by == "watchdog-stops")
    world = junior_world(WorldSettings(host=builds[mutant]))
    numbers = count(1)

    class Opener(AddressOpener):
        """Opens the link to a broken robot."""

        def __init__(self, *_: object, **__: object) -> None:
            super().__init__(parse_address("sim://junior"))
            self.clock, self.session = world, numbers.__next__

        def open(self) -> Link:
            return MemoryLink(world)

    monkeypatch.setattr("hil.connecting.connecting.AddressOpener", Opener)
    assert run(["check", "--quiet", "--only", "watchdog-stops"]) == 1
    said = capsys.readouterr().out
    assert "failed" in said
    assert "demanded: A robot that moves and hears nothing" in said
    assert "(WATCHDOG)" in said


def test_without_a_key_what_is_about_signatures_is_not_run(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    names = [check.name for check in CHECKS if check.keyed]
    wanted = [argument for name in names for argument in ("--only", name)]
    assert run(["check", *wanted]) == 0
    said = capsys.readouterr().out
    assert said.count("no key: --signing-key") == len(names) == 4
    path = folder / "our.key"
    path.touch(0o600)
    path.write_text(KEY.secret.hex())
    assert run(["check", *wanted, "--signing-key", str(path)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "5 passed"


def test_the_list_needs_no_robot(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", "serial:///dev/ttyNobody:115200", "--list", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert [entry["name"] for entry in listed] == [check.name for check in CHECKS]
    assert {entry["name"] for entry in listed if entry["wire"] != CAN} == set(NAMES)
    assert run(["check", "--list"]) == 0
    assert "emergency-stop-latched" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        (["--only", "nonsense"], 2, "there is no check 'nonsense'"),
        (["serial:///dev/ttyNobody:115200"], 3, "there is no port"),
        (["sim://junior?system=7", "--timeout", "0.3"], 3, "no robot with system id 7 answered within 0.3 s"),
        ([DEFAULT_URL, "--system", "9", "--timeout", "0.3"], 3, "no robot with system id 9"),
    ],
)
def test_no_robot_and_wrong_usage(capsys: pytest.CaptureFixture[str], arguments: list[str], status: int, said: str) -> None:
    assert run(["check", *arguments]) == status
    assert said in capsys.readouterr().err


# --- real time -------------------------------------------------------------------------------------------------------

REAL_TIME: Final = (
    "frame-in-pieces",
    "bad-checksum-dropped",
    "impossible-length-refused",
    "partial-frame-dropped",
    "good-frames-counted",
    "version-on-request",
    "timesync-answered",
    "sensors-50-hz",
    "parameters-listed",
    "parameters-whole",
    "same-sequence-performs-once",
    "emergency-stop-latched",
    "emergency-stop-at-once",
    "command-ack-addressed",
    "result-addressed",
    "stopped-state-said-at-once",
    "watchdog-stops",
    "heartbeats-do-not-keep",
    "alive-keeps",
    "alive-of-other-host-ignored",
    "ground-station-obeyed",
    "ground-station-keeps",
    "ground-station-not-kept-by-others",
    "new-keeper-stops-motion",
    "wheels-run-out",
    "reboot-comes-up-disarmed",
    "result-repeated",
    "memory-checksum",
    "contest-countdown",
    "wheels-turn-as-told",
)


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs a pty")
def test_it_passes_over_a_pty_in_real_time(capsys: pytest.CaptureFixture[str]) -> None:
    wanted = [argument for name in REAL_TIME for argument in ("--only", name)]
    with served("pty") as url:
        status = run(["check", url, "--moving", "--no-log", "--json", *wanted])
    verdicts = json.loads(capsys.readouterr().out)
    assert [verdict for verdict in verdicts if not verdict["passed"]] == []
    assert status == 0
    assert len(verdicts) == len(REAL_TIME) + 1


ON_A_BUS: Final = [check.name for check in OF_JUNIOR if check.wire == CAN]
SOME: Final = [
    "stop-frame-stops",
    "heartbeats-do-not-keep",
    "alive-keeps",
    "ground-station-keeps",
    "transfers-interleaved",
    "lost-transfers-counted",
]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("link", "names"),
    [
        pytest.param("can://virtual/checked", SOME, marks=pytest.mark.nightly),
        (MULTICAST, ON_A_BUS),
        pytest.param("slcan", ON_A_BUS, marks=pytest.mark.nightly),
    ],
)
def test_it_passes_over_a_bus_in_real_time(link: str, names: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    wanted = [argument for name in names for argument in ("--only", name)]
    with served(link) as url:
        status = run(["check", url, "--json", *wanted])
    verdicts = json.loads(capsys.readouterr().out)
    assert [verdict for verdict in verdicts if not verdict["passed"]] == []
    assert status == 0
    assert len(verdicts) == len(names) + 1


def test_a_check_of_the_other_wire_is_run_only_when_asked_for_and_then_says_why_it_is_not(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run(["check", "sim://junior?wire=can", "--only", "bad-checksum-dropped", "--only", "stop-frame-stops"]) == 0
    said = capsys.readouterr().out
    assert "only on links that carry MAVLink bytes" in said
    assert run(["check", "sim://junior?wire=can", "--json"]) == 0
    details = {verdict["name"]: verdict["detail"] for verdict in json.loads(capsys.readouterr().out)}
    assert details.keys() == {check.name for check in on_wire(CHECKS, CAN)} | {LAST.name}
    assert {name for name, detail in details.items() if detail == "a bus has no source"} == NEED_SOURCES


def test_a_node_is_picked_by_its_number(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", "sim://junior?wire=can&node=1", "--only", "stop-frame-stops"]) == 0
    assert run(["check", "sim://junior?wire=can&node=7", "--timeout", "0.3"]) == 3
    assert "no robot with system id 7" in capsys.readouterr().err
