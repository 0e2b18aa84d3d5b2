"""The package's pytest plugin, as a repository that tests its own robot program meets it."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from typing import TYPE_CHECKING

import pytest

# Loaded before the inner runs, which forget what they have loaded themselves.
import firmware_protocol.links.faulty  # noqa: F401
import hil.sumo.ring
import simdevice.serving.server
from firmware_protocol.errors import RefusedError
from firmware_protocol.messages import State
from firmware_protocol.wire.signing import SigningKey
from hil.bridge.clock import MonotonicClock
from simdevice.serving.endpoints import TcpEndpoint
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from hil import Junior
    from hil.pytest_plugin import ServedJunior
    from simdevice.sumo.world import World

pytest_plugins = ["pytester"]

NEEDS_PTY = pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals here")
STRICT = ("-W", "error", "--strict-markers", "-p", "no:cacheprovider", "-p", "no:hypothesispytest")


def test_junior_is_connected_and_disarmed(junior: Junior) -> None:
    assert not junior.armed
    with pytest.raises(RefusedError, match="not armed"):
        junior.drive(0.3, 0.3)
    junior.arm()
    assert junior.perform(["L"]).done == 1


def test_the_world_is_the_one_junior_lives_in(junior: Junior, junior_world: World) -> None:
    junior.arm()
    junior.drive(0.5, -0.5)
    assert junior_world.device.wheels == (0.5, -0.5)
    junior.stop()
    assert junior_world.device.wheels == (0.0, 0.0)


@pytest.mark.junior(opponent="flat-heavy", seed=3, faults="drop:0.2,jitter:0.02", referee=False)
def test_the_mark_says_what_is_wanted(junior: Junior, junior_world: World) -> None:
    assert junior_world.match.name == "flat-heavy"
    assert junior.referee is None
    junior.arm()
    for _ in range(20):
        junior.read_sensors()
    assert junior.peer.counters.retries > 0
    assert junior.peer.counters.lost > 0


@NEEDS_PTY
def test_a_served_junior_runs_by_itself(junior_pty: ServedJunior) -> None:
    with hil.connect(junior_pty.url) as robot:
        robot.arm()
        robot.drive(0.4, 0.4)
        assert junior_pty.world.device.wheels == (0.4, 0.4)
    assert os.path.exists(junior_pty.path)  # noqa: PTH110 - a port's name is what users have


def test_the_closest_mark_wins(pytester: pytest.Pytester) -> None:
    pytester.makepyfile("""
        import pytest

        pytestmark = pytest.mark.junior(opponent="curved-light", seed=5)

        @pytest.mark.junior(seed=7)
        def test_wanted(junior_emulation, junior):
            assert (junior_emulation.opponent, junior_emulation.seed) == ("curved-light", 7)
            assert junior_emulation.faults == "drop:0.01"
    """)
    run = pytester.runpytest_inprocess(*STRICT, "--hil-opponent", "junior", "--hil-faults", "drop:0.01")
    run.assert_outcomes(passed=1)


@pytest.mark.parametrize(
    ("mark", "message"),
    [
        ("oponent='flat-heavy'", "*oponent is nothing it takes by name; known are opponent, seed, faults*"),
        ("'flat-heavy'", "*'flat-heavy' is nothing it takes by name*"),
        ("opponent='nobody'", "*unknown opponent 'nobody': expected one of flat-light*"),
        ("faults='flood:1'", "*unknown fault 'flood': known are drop*"),
    ],
)
def test_a_wrong_mark_is_named(pytester: pytest.Pytester, mark: str, message: str) -> None:
    pytester.makepyfile(f"""
        import pytest

        @pytest.mark.junior({mark})
        def test_wrong(junior):
            pass
    """)
    run = pytester.runpytest_inprocess(*STRICT)
    run.assert_outcomes(errors=1)
    run.stdout.fnmatch_lines([message])


LEAVES_IT_ARMED = """
    import pytest

    import hil
    from firmware_protocol.errors import LinkClosedError

    def leave(robot):
        robot.arm()
        robot.drive(0.5, 0.5)
        robot.bridge.close()

    def test_program(junior_pty):
        leave(hil.connect(junior_pty.url))

    @pytest.mark.junior(left_armed=True)
    def test_crash(junior_pty):
        leave(hil.connect(junior_pty.url))

    @pytest.mark.junior(faults="unplug:0.5")
    def test_unplugged(junior):
        junior.arm()
        with pytest.raises(LinkClosedError):
            junior.wait(1.0)
"""


@NEEDS_PTY
def test_a_robot_left_armed_fails_the_test(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(LEAVES_IT_ARMED)
    run = pytester.runpytest_inprocess(*STRICT)
    run.assert_outcomes(passed=3, errors=2)
    run.stdout.fnmatch_lines(["the test left the robot armed (READY): disarm it, or mark the test junior(left_armed=True)"])


def test_wheels_that_go_on_turning_fail_the_test(pytester: pytest.Pytester) -> None:
    pytester.makepyfile("""
        from firmware_protocol.messages import ContestCommand
        from firmware_protocol.roles.junior import contest, write_memory
        from hil import Maneuver, Action

        def test_contest(junior):
            junior.finish(write_memory(junior.peer, 255, 0, Maneuver((Action.L,))))
            junior.arm()
            junior.finish(contest(junior.peer, ContestCommand.START, countdown=0.0))
            junior.wait(0.1)
            junior.bridge.close()
    """)
    run = pytester.runpytest_inprocess(*STRICT)
    run.assert_outcomes(passed=1, errors=1)
    run.stdout.fnmatch_lines(["the wheels still turn 2.5 s after the test: *"])


@pytest.mark.slow
@NEEDS_PTY
def test_the_robot_at_a_link_takes_the_emulated_one_s_place(pytester: pytest.Pytester, junior_pty: ServedJunior) -> None:
    pytester.makepyfile("""
        import pytest

        def test_first(junior):
            junior.arm()
            junior.drive(0.3, 0.3)

        @pytest.mark.junior(opponent="point-light")
        def test_second(junior):
            assert not junior.armed
            assert junior.bridge.link.url.startswith("serial://")
            assert junior.referee.state().opponent_code == 5

        def test_emulated(junior, junior_world):
            pass

        @pytest.mark.junior(faults="drop:0.1")
        def test_faults(junior):
            pass
    """)
    run = pytester.runpytest_inprocess(*STRICT, "-rs", "--hil-link", junior_pty.url)
    run.assert_outcomes(passed=2, skipped=2)
    run.stdout.fnmatch_lines(["*needs an emulated robot, and --hil-link gives another*"])


@pytest.mark.slow
def test_a_robot_at_a_link_that_signs(pytester: pytest.Pytester) -> None:
    key = SigningKey(bytes(range(1, 33)))
    path = pytester.path / "our.key"
    path.touch(0o600)
    path.write_text(key.secret.hex())
    pytester.makepyfile("""
        def test_signed(junior):
            junior.arm()
            assert junior.bridge.signed > 0
    """)
    endpoint = TcpEndpoint(port=0)
    world, stop = junior_world(WorldSettings(signing_key=key)), threading.Event()
    thread = threading.Thread(target=simdevice.serving.server.serve, args=(world, endpoint, MonotonicClock(), stop.is_set))
    thread.start()
    try:
        run = pytester.runpytest_inprocess(*STRICT, "--hil-link", endpoint.url, "--hil-signing-key", str(path))
    finally:
        stop.set()
        thread.join(10)
    run.assert_outcomes(passed=1)


def test_a_key_without_a_link_is_told(pytester: pytest.Pytester) -> None:
    run = pytester.runpytest_inprocess(*STRICT, "--hil-signing-key", "our.key")
    assert run.ret == pytest.ExitCode.USAGE_ERROR
    run.stderr.fnmatch_lines(["*--hil-signing-key is the key of the robot at --hil-link URL, or of the logs*"])


def test_without_pseudo_terminals_it_skips(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(os, "openpty", raising=False)
    pytester.makepyfile("def test_program(junior_pty): pass")
    run = pytester.runpytest_inprocess(*STRICT, "-rs")
    run.assert_outcomes(skipped=1)
    run.stdout.fnmatch_lines(["*no pseudo-terminal: * Serve on tcp://127.0.0.1:5760 instead*"])


def test_loading_the_plugin_loads_nothing_heavy() -> None:
    program = (
        "import sys, pytest; before = set(sys.modules); import hil.pytest_plugin; "
        "print(*sorted({name.partition('.')[0] for name in set(sys.modules) - before}))"
    )
    done = subprocess.run([sys.executable, "-W", "error", "-c", program], capture_output=True, text=True, check=True)  # noqa: S603
    assert set(done.stdout.split()) <= {"hil", "threading", "__future__"}


def test_state_is_the_robot_s_word(junior: Junior) -> None:
    junior.emergency_stop()
    junior.wait(1.1)
    assert junior.state is State.STOPPED
