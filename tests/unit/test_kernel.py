"""The kernel's contract with who runs it: when it comes back, who may look, and what it refuses to run with."""

from __future__ import annotations

import dataclasses
import math
import os
import shlex
import shutil
import subprocess
import sys
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING

import pymunk
import pytest
from kernel_twins import Twins
from pymunk._chipmunk_cffi import ffi as chipmunk_ffi
from pymunk._chipmunk_cffi import lib as chipmunk_lib

from firmware_protocol.errors import FirmwareBuildError, PhysicsVersionError
from firmware_protocol.faults.spec import FaultSpec
from firmware_protocol.firmware.build_host import INCLUDES, ROOT
from firmware_protocol.firmware.fit import check_digest
from firmware_protocol.firmware.headers import make_headers
from firmware_protocol.messages import (
    REFEREE_COMPONENT,
    BoutOutcome,
    Command,
    CommandLong,
    OpponentCode,
    ParamSet,
    RefereeReset,
    RobotAlive,
)
from firmware_protocol.wire.codec import open_codec
from firmware_protocol.wire.fields import CAN
from firmware_protocol.wire.mavlink import MavlinkCodec
from firmware_protocol.wire.signing import SigningKey
from simdevice._host import lib
from simdevice.boards import board_host
from simdevice.kernel import chipmunk
from simdevice.kernel.built_from import KERNEL, digest
from simdevice.kernel.world import KernelWorld
from simdevice.outline import Outline
from simdevice.sumo.crowd import Crowd
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.opponents import OPPONENTS
from simdevice.sumo.settings import WorldSettings
from simdevice.sumo.world import World

if TYPE_CHECKING:
    from pathlib import Path


CODEC = MavlinkCodec(system=255, component=190)


# --- when it comes back ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("make", [World, KernelWorld])
def test_it_comes_back_when_something_is_sent_and_not_before(make: type[World]) -> None:
    by_steps, at_once = make(), make()
    assert by_steps.step(b"") == at_once.step(b"") != b""
    sent, steps = b"", 0
    while not sent:
        sent = by_steps.step(b"")
        steps += 1
    assert at_once.run(b"", steps - 1) == []
    assert at_once.now() == pytest.approx(steps * at_once.period)
    assert at_once.run(b"", 1) == [(by_steps.now(), sent)]


@pytest.mark.parametrize("make", [World, KernelWorld])
def test_it_comes_back_when_a_bout_is_decided_though_nobody_says_so(make: type[World]) -> None:
    world = make(WorldSettings(referee=False))
    while world.match.outcome is BoutOutcome.UNDECIDED:
        assert world.now() < 15.1
        world.run(b"", 10_000)
    assert world.now() == pytest.approx(15.0 + 4 * world.period)  # a draw, after everybody has been put down


@pytest.mark.parametrize("make", [World, KernelWorld])
def test_it_comes_back_when_the_robot_boots_again(make: type[World]) -> None:
    world = make(WorldSettings(referee=False))
    world.run(CODEC.encode(CommandLong(1, 1, Command.PREFLIGHT_REBOOT, param1=1.0)), 200)
    for _ in range(100):
        if not world.device.uptime:
            break
        world.run(b"", 200)
    assert not world.device.uptime


def test_a_board_of_another_kind_is_run_by_the_python_world() -> None:
    assert type(junior_world()) is KernelWorld
    assert type(junior_world(WorldSettings(host=board_host()))) is World


@pytest.mark.parametrize(
    "settings",
    [
        WorldSettings(seed=5),
        WorldSettings(seed=5, wire=CAN),
        WorldSettings(seed=5, opponent="junior"),
        WorldSettings(seed=5, faults=FaultSpec.parse("wheel:left:0.37@0.4+0.9,brownout:1.1+0.4,stuck:eye_right@0.3+2")),
        WorldSettings(seed=5, signing_key=SigningKey(bytes(range(32)))),
        WorldSettings(seed=5, referee=False),
    ],
    ids=["mavlink", "can", "second junior", "faults", "signed", "no referee"],
)
def test_a_crowd_says_the_same_in_the_kernel(settings: WorldSettings) -> None:
    kernel, oracle = Crowd(3, settings), Crowd(3, dataclasses.replace(settings, host=board_host()))
    codec = open_codec(settings.wire, system=255, component=190)
    done = {
        200: lambda crowd: crowd.switch_off(2),
        300: lambda crowd: crowd.switch_on(2),
        350: lambda crowd: crowd.unplug(3),
        420: lambda crowd: crowd.plug(3),
    }
    for number in range(600):
        data = codec.encode(RobotAlive(7)) if number % 8 == 0 else b""
        if number == 100:
            data += codec.encode(ParamSet(2, 1, "SYS_ID", 9.0))
        if number in {130, 360}:
            keep = OpponentCode.KEEP
            resets = [RefereeReset(number, 77, number, system, REFEREE_COMPONENT, keep) for system in (1, 3, 9)]
            data += b"".join(map(codec.encode, resets))
        if number in done:
            for crowd in (kernel, oracle):
                done[number](crowd)
        assert kernel.step(data) == oracle.step(data), number
    assert kernel.nvm == oracle.nvm


def test_one_robot_of_a_crowd_cannot_live_alone() -> None:
    crowd = Crowd(2)
    with pytest.raises(RuntimeError, match="let the crowd live"):
        crowd.members[1].world.step(b"")


# --- who looks -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("watched", [False, True])
def test_who_moves_what_is_on_the_table_moves_it_in_the_kernel(watched: bool) -> None:  # noqa: FBT001 - pytest's
    twins = Twins({"seed": 3}, watched=watched)
    twins.live(b"", 50)
    for world in (twins.oracle, twins.kernel):
        world.match.robot.body.place(0.0, -0.1, 1.2)
        world.match.opponent.place(0.1, 0.05, 0.3)
    twins.kernel._ring.watched = True
    twins.live(b"", 50)
    for world in (twins.oracle, twins.kernel):
        world.match.reset(8)
    twins.kernel._ring.watched = True
    twins.live(b"", 50)


def test_what_is_held_on_to_is_kept_up_to_date() -> None:
    world = KernelWorld(WorldSettings(seed=3))
    body, sensors = world.match.robot.body, world.device.robot.sensors
    body.place(0.2, 0.1, 0.0)
    world.match.opponent.place(0.05, 0.1, 0.0)
    world.run(b"", 1)
    world.device.robot.body.place(-0.1, 0.1, 0.0)
    for _ in range(20):
        world.run(b"", 1)
    assert (body.x, body.y) == pytest.approx((-0.1, 0.1), abs=1e-3)
    assert sensors.distance_left == pytest.approx(0.05 - 0.02 - (-0.1 + 0.045), abs=0.02)


def test_an_outline_of_too_many_corners_is_refused_by_their_number(monkeypatch: pytest.MonkeyPatch) -> None:
    corners = tuple((0.05 * math.cos(0.3 * number), 0.05 * math.sin(0.3 * number)) for number in range(20))
    round_one = dataclasses.replace(OPPONENTS["flat-light"], outline=Outline(corners))
    monkeypatch.setitem(OPPONENTS, "flat-light", round_one)
    with pytest.raises(ValueError, match="at most 16 corners in the kernel, not 20"):
        KernelWorld()


# --- what it is made of ----------------------------------------------------------------------------------------------


def test_what_it_is_made_from_is_compiled_in() -> None:
    assert digest() == lib.KERNEL_BUILT_FROM  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", ["world.c", "order.h", "loop.h", "../build_host.py"])
def test_any_change_is_noticed(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "kernel"
    shutil.copytree(KERNEL, folder)
    shutil.copy(KERNEL.parent / "build_host.py", tmp_path)
    assert digest(folder) == digest()
    (folder / name).write_bytes((folder / name).read_bytes() + b"\n")
    with pytest.raises(FirmwareBuildError, match=r"has changed since it was built: in .* build in place"):
        check_digest(lib, "KERNEL_BUILT_FROM", digest(folder))
    for path in folder.glob("*.c"):
        path.unlink()
    check_digest(lib, "KERNEL_BUILT_FROM", digest(folder))  # stripped of its sources: nothing to compare


def test_neither_the_world_nor_the_devices_know_the_other() -> None:
    tables = ("table.h", "table.c", "table_contact.c", "table_grid.c", "table_ring.c")
    worlds = ("world.h", "world.c", "sensors.c", "referee.h", "referee.c")
    for name in ("order.h", "physics.h", "outline.h", "outline.c", *worlds, *tables):
        text = (KERNEL / name).read_text(encoding="utf-8")
        assert "host" not in text, name
        assert "devices" not in text, name
    for name in ("devices.h", "devices.c"):
        assert "world.h" not in (KERNEL / name).read_text(encoding="utf-8"), name


@pytest.mark.parametrize("source", sorted(path.name for path in KERNEL.glob("*.c")))
def test_it_is_c99_and_nothing_else(source: str) -> None:
    make_headers()
    strict = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Wshadow", "-Wconversion", "-Wmissing-prototypes", "-Werror"]
    folders = [argument for name in INCLUDES for argument in ("-isystem" if "_build" in name else "-I", str(ROOT / name))]
    command = [*(shlex.split(os.environ.get("CC", "")) or ["cc"]), *strict, *folders, "-fsyntax-only", str(KERNEL / source)]
    done = subprocess.run(command, check=False, capture_output=True, text=True)  # noqa: S603
    assert done.returncode == 0, done.stderr


# --- pymunk ----------------------------------------------------------------------------------------------------------


def other_pymunk(monkeypatch: pytest.MonkeyPatch, ffi: object, functions: object) -> str:
    """A module that stands in for pymunk's library."""
    module = ModuleType("other_chipmunk")
    module.ffi, module.lib = ffi, functions  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, module.__name__, module)
    return module.__name__


def test_a_pymunk_without_its_library_is_refused_with_what_to_install() -> None:
    with pytest.raises(PhysicsVersionError, match=rf"pymunk {pymunk.version} is not as .*No module.*install.*pymunk>=7,<8"):
        chipmunk._load("pymunk._nothing")


def test_a_pymunk_without_a_function_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def without(_lib: object, name: str) -> object:
        raise AttributeError(f"no function {name}")

    ffi = SimpleNamespace(addressof=without)
    with pytest.raises(PhysicsVersionError, match="no function cpSpaceStep"):
        chipmunk._load(other_pymunk(monkeypatch, ffi, chipmunk_lib))


def test_a_pymunk_whose_function_takes_something_else_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def another(_lib: object, _name: str) -> object:
        return chipmunk_ffi.addressof(chipmunk_lib, "cpBodyGetAngle")

    ffi = SimpleNamespace(addressof=another, typeof=chipmunk_ffi.typeof)
    with pytest.raises(PhysicsVersionError, match="cpSpaceStep is a double"):
        chipmunk._load(other_pymunk(monkeypatch, ffi, chipmunk_lib))


def test_a_pymunk_whose_bodies_hold_something_else_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chipmunk, "_ATTRIBUTES", {"Body": "_struct", "Space": "_space"})
    with pytest.raises(PhysicsVersionError, match="a Body has no _struct"):
        chipmunk._load()
