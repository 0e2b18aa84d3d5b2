"""Fixtures for testing robot programs: an emulated Junior in lock-step, on a pseudo-terminal, or a robot at `--hil-link`.

pytest loads this module in every run of an environment that has the package: whatever takes time to load is loaded by the
fixtures, when a test asks for a robot.

    junior          a connected `hil.Junior`: emulated, in lock-step, or the robot at `--hil-link URL`
    junior_world    the emulated world itself, for host software that brings its own MAVLink stack
    junior_pty      an emulated Junior served in real time on a pseudo-terminal, for programs that open a serial port
    hil_replay      replays a log of a run, see `hil.pytest_replay`; `--hil-replay PATTERN` makes a test of each log

With `--hil-logs DIR` failing tests leave the logs of their robots, see `hil.pytest_logs`.

`@pytest.mark.junior(opponent="flat-heavy", seed=3, faults="drop:0.05")` says what a test wants; the closest mark wins.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import pytest

from hil import pytest_logs
from hil.pytest_logs import begin_link_log, begin_test_log, note_test

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from firmware_protocol.faults.spec import FaultSpec
    from hil.bridge.taps import Tap
    from hil.sumo.junior import Junior
    from simdevice.sumo.world import World

pytest_plugins = ("hil.pytest_replay",)

REST_TIME = 2.5
"""Emulated time in which a robot left alone must have come to rest, in s: the longest watchdog is 2 s."""
THREAD_TIME = 10.0
"""Longest wait for the serving thread to end, in s."""


@dataclass(frozen=True)
class WantedJunior:
    """What a test wants of its emulated robot.

    Attributes:
        opponent: Its name, as on the command line: `flat-light`, or another of `OpponentCode`, in lower case.
        seed: Seed of everything random: start poses, noise, faults.
        faults: What goes wrong, as `drop:0.05,jitter:0.02,stuck:eye_left@5+3`, or `@FILE.toml`; of the line only for `junior`.
        referee: A referee watches the ring, as in no physical one.
        left_armed: The test means to leave the robot armed (its host crashes, for instance).
    """

    opponent: str = "flat-light"
    seed: int = 1
    faults: str = ""
    referee: bool = True
    left_armed: bool = False


@dataclass(frozen=True)
class ServedJunior:
    """An emulated Junior on a pseudo-terminal.

    Attributes:
        url: What `hil.connect` and every `hil` command take.
        path: The port, as any serial library takes it, such as `/dev/pts/3`.
        world: The world behind it: look at `world.device.wheels`; it is stepped by the serving thread.
    """

    url: str
    path: str
    world: World


def pytest_addoption(parser: pytest.Parser, pluginmanager: pytest.PytestPluginManager) -> None:
    """Add the options `--hil-...`, and what keeps logs: it has been imported already, so that no name of it would do."""
    pluginmanager.register(pytest_logs, "junior_hil_logs")
    group = parser.getgroup("junior-hil", "robots (junior-hil)")
    group.addoption("--hil-link", metavar="URL", help="run tests that ask for `junior` with the robot at this address")
    group.addoption("--hil-signing-key", metavar="FILE", help="key file of the robot at --hil-link, or of logs, if it signs")
    group.addoption("--hil-opponent", metavar="NAME", help="opponent of emulated robots, where a test does not say")
    group.addoption("--hil-seed", metavar="N", type=int, help="seed of emulated robots, where a test does not say")
    group.addoption(
        "--hil-faults",
        metavar="SPEC",
        help="what goes wrong with emulated robots and the line to them, where a test does not say",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Register the mark.

    Raises:
        UsageError: A key is given, and nothing that it is the key of; or one robot is to be used by several processes.
    """
    if config.getoption("--hil-link") and (config.getoption("numprocesses", None) or 0) > 1:
        text = "--hil-link is one robot, and several pytest-xdist workers can't share it: say -n 1, or leave -n out"
        raise pytest.UsageError(text)
    if config.getoption("--hil-signing-key") and not (config.getoption("--hil-link") or config.getoption("--hil-replay")):
        text = (
            "--hil-signing-key is the key of the robot at --hil-link URL, or of the logs at --hil-replay: give one of these too"
        )
        raise pytest.UsageError(text)
    config.addinivalue_line(
        "markers",
        "junior(opponent, seed, faults, referee, left_armed): what a test wants of its emulated robot, as "
        "junior(opponent='flat-heavy', seed=3, faults='drop:0.05,jitter:0.02')",
    )


@pytest.fixture
def junior_emulation(request: pytest.FixtureRequest) -> WantedJunior:
    """What this test wants, from its marks and the command line."""
    options = {name: request.config.getoption(f"--hil-{name}") for name in ("opponent", "seed", "faults")}
    wanted: dict[str, object] = {name: value for name, value in options.items() if value is not None}
    known = [field.name for field in fields(WantedJunior)]
    for mark in reversed(list(request.node.iter_markers("junior"))):
        unknown = [*map(repr, mark.args), *sorted(set(mark.kwargs) - set(known))]
        if unknown:
            pytest.fail(f"mark junior: {unknown[0]} is nothing it takes by name; known are {', '.join(known)}", pytrace=False)
        wanted |= mark.kwargs
    return WantedJunior(**wanted)  # type: ignore[arg-type]


@pytest.fixture
def junior_world(request: pytest.FixtureRequest, junior_emulation: WantedJunior) -> World:
    """An emulated Junior in its ring, in lock-step: bytes in, `step`, bytes out, 5 ms at a time.

    In a test that asks for `junior` as well, this is the world that robot lives in.
    """
    world = _world(junior_emulation)
    if "junior" not in request.fixturenames:  # else its bridge tells the log more
        _watch(request, world, "junior_world", "sim://junior", junior_emulation)
    return world


@pytest.fixture(scope="session")
def junior_at_link(request: pytest.FixtureRequest) -> Iterator[Junior]:
    """The robot at `--hil-link`, connected once for the whole run: opening a port resets many boards."""
    from hil.sumo.connecting import connect  # noqa: PLC0415

    url, key = request.config.getoption("--hil-link"), request.config.getoption("--hil-signing-key")
    log = begin_link_log(request.config, url)
    with connect(url, signing_key=key, taps=[log.recorder] if log is not None and log.recorder is not None else []) as robot:
        yield robot


@pytest.fixture
def junior(request: pytest.FixtureRequest, junior_emulation: WantedJunior) -> Iterator[Junior]:
    """A connected, disarmed Junior at the start of a bout. When the test ends it is disarmed, and must be at rest.

    Emulated, in lock-step: time passes only while the test waits for the robot. With `--hil-link URL` it is the robot
    there; what needs an emulated one (`junior_world`, faults) is skipped.
    """
    if request.config.getoption("--hil-link"):
        if "junior_world" in request.fixturenames or junior_emulation.faults:
            pytest.skip("needs an emulated robot, and --hil-link gives another")
        robot: Junior = request.getfixturevalue("junior_at_link")
        note_test(request.node)
        _place(robot, junior_emulation)
        yield robot
        _rest(robot)
        return
    world: World = request.getfixturevalue("junior_world")
    log = begin_test_log(request, "junior", "sim://junior", _described(junior_emulation), lockstep=True)
    robot = _connect(world, junior_emulation, [log.recorder] if log is not None and log.recorder is not None else [])
    try:
        _place(robot, junior_emulation)
        yield robot
    finally:
        robot.close()
    _check_rest(world, left_armed=junior_emulation.left_armed)


@pytest.fixture
def junior_pty(request: pytest.FixtureRequest, junior_emulation: WantedJunior) -> Iterator[ServedJunior]:
    """An emulated Junior in real time on a pseudo-terminal, which any program opens as a serial port.

    When the test ends, the robot must come to rest by itself and be disarmed. Skipped where the system has no
    pseudo-terminals.
    """
    from firmware_protocol.errors import LinkOpenError  # noqa: PLC0415
    from hil.bridge.clock import MonotonicClock  # noqa: PLC0415
    from simdevice.serving.endpoints import PtyEndpoint  # noqa: PLC0415
    from simdevice.serving.server import serve  # noqa: PLC0415

    world = _world(junior_emulation)
    try:
        endpoint = PtyEndpoint()
    except LinkOpenError as error:
        pytest.skip(str(error))
    _watch(request, world, "junior_pty", endpoint.url, junior_emulation)
    stop = threading.Event()
    failures: list[Exception] = []

    def run() -> None:
        try:
            serve(world, endpoint, MonotonicClock(), stop.is_set)
        except Exception as error:  # noqa: BLE001 - raised again in the test's own thread
            failures.append(error)

    thread = threading.Thread(target=run, name="junior_pty", daemon=True)
    thread.start()
    try:
        yield ServedJunior(endpoint.url, endpoint.path, world)
    finally:
        stop.set()
        thread.join(THREAD_TIME)
    if thread.is_alive():
        pytest.fail("the thread that serves the robot does not end", pytrace=False)
    for failure in failures:
        raise failure
    _check_rest(world, left_armed=junior_emulation.left_armed)


def _world(wanted: WantedJunior) -> World:
    """A new world; an opponent or a fault that does not exist fails the test."""
    from simdevice.sumo.junior_world import junior_world as make_world  # noqa: PLC0415 - pymunk takes a moment to load
    from simdevice.sumo.settings import WorldSettings  # noqa: PLC0415

    spec = _faults(wanted)
    try:
        return make_world(WorldSettings(opponent=wanted.opponent, seed=wanted.seed, referee=wanted.referee, faults=spec))
    except ValueError as error:
        message = f"mark junior: {error}"
    pytest.fail(message, pytrace=False)


def _watch(request: pytest.FixtureRequest, world: World, title: str, link: str, wanted: WantedJunior) -> None:
    """Have a log written of what passes between a world and whoever speaks with it, where that is asked for."""
    log = begin_test_log(request, title, link, _described(wanted), lockstep=title == "junior_world")
    if log is not None and log.recorder is not None:
        from hil.recording.line_log import LineLog  # noqa: PLC0415

        log.ending.append(LineLog(world, log.recorder).end)


def _described(wanted: WantedJunior) -> dict[str, str]:
    """What a log says of what a test wants."""
    return {"opponent": wanted.opponent, "seed": str(wanted.seed), "faults": wanted.faults}


def _faults(wanted: WantedJunior) -> FaultSpec:
    """What is to go wrong; something wrong in that fails the test."""
    from hil.files.fault_file import read_faults  # noqa: PLC0415

    try:
        return read_faults(wanted.faults)
    except ValueError as error:
        message = f"mark junior: {error}"
    pytest.fail(message, pytrace=False)


def _connect(world: World, wanted: WantedJunior, taps: Sequence[Tap]) -> Junior:
    """Connect to the robot in a world, in lock-step."""
    from firmware_protocol.links.faulty import FaultyLink  # noqa: PLC0415
    from firmware_protocol.links.memory import MemoryLink  # noqa: PLC0415
    from firmware_protocol.wire.mavlink import split_frames  # noqa: PLC0415
    from hil.bridge.bridge import Bridge  # noqa: PLC0415
    from hil.seeds import Branch, generator  # noqa: PLC0415
    from hil.sumo.junior import Junior  # noqa: PLC0415

    spec = _faults(wanted)
    link = FaultyLink(MemoryLink(world, "sim://junior"), spec, seed=wanted.seed, clock=world, split=split_frames)
    numbers = generator(wanted.seed, Branch.SESSION)
    robot = Junior(Bridge(link, world, taps=taps, session=lambda: int(numbers.integers(1, 0x10000))))
    try:
        robot.find()
    except BaseException:
        robot.close()
        raise
    return robot


def _place(robot: Junior, wanted: WantedJunior) -> None:
    """Begin a bout, where there is a referee: without one nobody says how it ends, and a person sets up the ring."""
    from hil.sumo.ring import open_ring  # noqa: PLC0415

    if robot.referee is not None:
        open_ring(robot, wanted.opponent).begin(wanted.seed)


def _rest(robot: Junior) -> None:
    """Stop and disarm the robot at the link, and see that it says so."""
    from firmware_protocol.errors import HilError  # noqa: PLC0415
    from firmware_protocol.messages import Heartbeat, State  # noqa: PLC0415

    try:
        robot.disarm()
        heartbeat = robot.finish(robot.peer.request(Heartbeat))
    except HilError as error:
        pytest.fail(f"the robot could not be disarmed at the end of the test: {error}", pytrace=False)
    if heartbeat.custom_mode != State.DISARMED:
        pytest.fail(f"the robot is not disarmed at the end of the test, but {State(heartbeat.custom_mode).name}", pytrace=False)


def _check_rest(world: World, *, left_armed: bool) -> None:
    """Leave the robot alone for a while: its wheels must come to a stop, and it must not be armed.

    Its state is asked for on the wire, as a host would.
    """
    from firmware_protocol.events import Received  # noqa: PLC0415
    from firmware_protocol.messages import (  # noqa: PLC0415
        HOST_COMPONENT,
        HOST_SYSTEM,
        ROBOT_COMPONENT,
        Command,
        CommandLong,
        Heartbeat,
        State,
    )
    from firmware_protocol.wire.mavlink import MavlinkCodec  # noqa: PLC0415

    deadline = world.now() + REST_TIME
    while world.device.wheels != (0.0, 0.0) and world.now() < deadline:
        world.step(b"")
    if world.device.wheels != (0.0, 0.0):
        pytest.fail(f"the wheels still turn {REST_TIME:g} s after the test: {world.device.wheels}", pytrace=False)
    codec = MavlinkCodec(system=HOST_SYSTEM, component=HOST_COMPONENT)
    question = CommandLong(world.device.system, ROBOT_COMPONENT, Command.REQUEST_MESSAGE, 0, float(Heartbeat.ID))
    answers = codec.receive(world.step(codec.encode(question)) + world.step(b""), world.now())
    heard = [event.message for event in answers if isinstance(event, Received) and isinstance(event.message, Heartbeat)]
    states = [State(heartbeat.custom_mode) for heartbeat in heard]
    if not left_armed and (not states or states[-1] not in {State.DISARMED, State.STOPPED}):
        name = states[-1].name if states else "silent"
        text = f"the test left the robot armed ({name}): disarm it, or mark the test junior(left_armed=True)"
        pytest.fail(text, pytrace=False)
