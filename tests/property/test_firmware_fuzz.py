"""Whatever bytes come: no crash, no motion while disarmed, and the next good frame is understood."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING, Any

import pytest
from firmware_bench import HOST, FirmwareBench
from hypothesis import given, settings
from hypothesis import strategies as st
from micro_bench import MicroBench

from firmware_protocol.generate.vectors import vectors
from firmware_protocol.messages import Command, CommandLong, Ping, State
from firmware_protocol.wire.fields import Direction
from simdevice._host import ffi, lib

if TYPE_CHECKING:
    from collections.abc import Iterator

GOLDEN = [v.frame for v in vectors() if v.message.DIRECTION is not Direction.UP]
ROLES = (FirmwareBench, MicroBench)
ARM = CommandLong(target_system=1, target_component=1, command=int(Command.ARM_DISARM), param1=1.0)


def damaged_chunks(total: int, seed: int) -> Iterator[bytes]:
    """Random bytes, and frames with one to three bits changed, cut off, doubled or run together."""
    rng = random.Random(seed)
    done = 0
    while done < total:
        frame = bytearray(rng.choice(GOLDEN))
        match rng.randrange(5):
            case 0:
                frame = bytearray(rng.randbytes(rng.randrange(1, 80)))
            case 1:
                del frame[rng.randrange(len(frame)) :]
            case 2:
                frame += bytearray([0xFD]) * rng.randrange(4)
            case _:
                for _ in range(rng.randrange(1, 4)):
                    frame[rng.randrange(len(frame))] ^= 1 << rng.randrange(8)
        done += len(frame)
        yield bytes(frame)


@pytest.mark.parametrize("kind", ROLES)
def test_a_million_damaged_bytes(kind: type[FirmwareBench]) -> None:
    bench = kind()
    robot: Any = bench.robot
    wheel = bench.io.wheel
    micros = 0
    for i, chunk in enumerate(damaged_chunks(1_000_000, seed=20)):
        micros += 5000
        lib.host_tick(robot, micros, chunk, len(chunk))
        assert wheel[0] == 0 == wheel[1]
        if i % 200 == 0:
            assert lib.host_state(robot) in {State.DISARMED, State.STOPPED}
            for _ in range(5):
                micros += 5000
                lib.host_tick(robot, micros, b"", 0)
            ping = bench.host.encode(Ping(time_usec=i, seq=i))
            length = lib.host_tick(robot, micros + 5000, ping, len(ping))
            assert i.to_bytes(4, "little").rstrip(b"\0") in bytes(ffi.buffer(bench.io.tx, length))


@pytest.mark.slow
@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.lists(st.one_of(st.binary(max_size=60), st.sampled_from(GOLDEN)), max_size=20), st.data())
def test_good_frames_between_noise_without_markers_are_all_taken(pieces: list[bytes], data: st.DataObject) -> None:
    bench = FirmwareBench()
    stream = b""
    for number, piece in enumerate(pieces):
        stream += piece.replace(b"\xfd", b"\xfc") + bench.host.encode(Ping(time_usec=1, seq=number))
    while stream:
        size = data.draw(st.integers(1, max(1, len(stream))))
        bench.tick(raw=stream[:size])
        stream = stream[size:]
    assert [ping.seq for ping in bench.got(Ping)] == list(range(len(pieces)))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ROLES)
@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.lists(st.sampled_from(GOLDEN), min_size=1, max_size=5), st.randoms(use_true_random=False))
def test_three_damaged_bits_never_arm_and_never_move(
    kind: type[FirmwareBench], frames: list[bytes], rng: random.Random
) -> None:
    bench = kind()
    arm = bench.host.encode(ARM)
    for frame in (*frames, arm):
        damaged = bytearray(frame)
        for bit in rng.sample(range(8 * len(frame)), rng.randint(1, 3)):
            damaged[bit // 8] ^= 1 << bit % 8
        bench.tick(raw=bytes(damaged))
    bench.run(50, alive=False)
    assert bench.state() is State.DISARMED
    assert bench.wheels == (0, 0)


def test_a_thousand_robots_live_side_by_side() -> None:
    robots = [FirmwareBench() for _ in range(1000)]
    for i, bench in enumerate(robots):
        if i % 3 == 0:
            bench.tick(ARM)
        bench.eyes(left=i % 2 == 0, right=False)
    for _ in range(5):
        for bench in robots:
            bench.tick(HOST)
    states = [bench.state() for bench in robots]
    assert states == [State.READY if i % 3 == 0 else State.DISARMED for i in range(1000)]
    assert all(bench.wheels == (0, 0) for bench in robots)
