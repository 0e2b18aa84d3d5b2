"""The faulty link: the same seed does the same, and each fault befalls the share of frames it should."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.clock import ManualClock
from firmware_protocol.errors import LinkClosedError, LinkOpenError, LinkTimeoutError
from firmware_protocol.link import Link
from firmware_protocol.links import FaultSpec, FaultyLink, MemoryLink
from firmware_protocol.mavlink import MavlinkCodec, split_frames
from firmware_protocol.messages import HOST_SYSTEM, Heartbeat, Ping
from hil.clock import MonotonicClock


@dataclass
class Echo:
    """A device that sends back what it gets, one control period later."""

    came: list[tuple[float, bytes]] = field(default_factory=list)
    ticks: int = 0
    last: bytes = b""

    def now(self) -> float:
        return self.ticks * 0.005

    def step(self, inbound: bytes) -> bytes:
        self.ticks += 1
        if inbound:
            self.came.append((self.now(), inbound))
        data, self.last = self.last, inbound
        return data


def frames(count: int) -> list[bytes]:
    codec = MavlinkCodec(system=HOST_SYSTEM, component=190)
    return [codec.encode(Ping(time_usec=1 + 77 * k, seq=k)) for k in range(count)]


def one_way(spec: str, count: int = 2000, seed: int = 3) -> tuple[FaultyLink, list[bytes]]:
    """Send frames down a faulty link, several in a piece, and collect what arrives."""
    device = Echo()
    link = FaultyLink(MemoryLink(device), FaultSpec.parse(spec), FaultSpec(), seed=seed, clock=device, split=split_frames)
    sent = frames(count)
    for k in range(0, count, 5):
        link.write(b"".join(sent[k : k + 5]))
        link.read(0.005)
    while device.now() < count / 5 * 0.005 + 1:
        link.read(0.1)
    return link, split_frames(b"".join(data for _, data in device.came))


def test_nothing_asked_for_nothing_done() -> None:
    link, arrived = one_way("")
    assert arrived == frames(2000)
    assert (link.down.frames, link.down.dropped, link.down.corrupted, link.down.delayed) == (2000, 0, 0, 0)


def test_drop_takes_single_frames_out_of_a_piece() -> None:
    link, arrived = one_way("drop:0.05")
    assert len(arrived) == 2000 - link.down.dropped
    assert set(arrived) <= set(frames(2000))
    assert 70 <= link.down.dropped <= 130  # 100 expected, standard deviation 9.7


def test_corruption_flips_one_to_three_bits_of_the_payload() -> None:
    link, arrived = one_way("corrupt:0.2")
    flips = []
    for good, came in zip(frames(2000), arrived, strict=True):
        wrong = int.from_bytes(good) ^ int.from_bytes(came)
        if wrong:
            flips.append(wrong.bit_count())
            assert good[:10] == came[:10]
            assert good[-2:] == came[-2:]
    assert len(flips) == link.down.corrupted
    assert 330 <= len(flips) <= 470
    assert {1, 2, 3} == set(flips)


def test_no_damage_of_one_to_three_payload_bits_passes_the_checksum() -> None:
    _, arrived = one_way("corrupt:1.0", count=3000)
    events = MavlinkCodec(system=1, component=1).receive(b"".join(arrived), 0.0)
    assert not [event for event in events if hasattr(event, "message")]


def test_duplicates_arrive_twice() -> None:
    link, arrived = one_way("duplicate:0.1")
    assert len(arrived) == 2000 + link.down.duplicated
    assert list(dict.fromkeys(arrived)) == frames(2000)
    assert 150 <= link.down.duplicated <= 250


def test_delay_passes_in_the_devices_time() -> None:
    device = Echo()
    link = FaultyLink(MemoryLink(device), FaultSpec(delay=0.03), seed=1, clock=device)
    link.write(b"ping")
    assert link.read(0.2) == b"ping"
    assert [time for time, _ in device.came] == [pytest.approx(0.035)]  # 30 ms late, then the next control period
    assert device.now() == pytest.approx(0.07)  # a period to answer, and 30 ms back


def test_jitter_is_within_its_bounds_and_keeps_the_order_of_a_wire() -> None:
    link, arrived = one_way("jitter:0.02")
    assert arrived == frames(2000)
    assert link.down.delayed == 2000


def test_jitter_may_change_the_order_of_a_network() -> None:
    _, arrived = one_way("jitter:0.02,reorder")
    assert arrived != frames(2000)
    assert sorted(arrived) == sorted(frames(2000))


def test_unplugging_hands_over_what_had_arrived_and_then_says_so() -> None:
    device = Echo()
    link = FaultyLink(MemoryLink(device), FaultSpec(delay=0.02, unplug=0.05), seed=1, clock=device)
    link.write(b"a")
    assert link.read(1.0) == b"a"
    assert device.now() >= 0.05
    for _ in range(2):
        with pytest.raises(LinkClosedError, match="unplugged"):
            link.read(1.0)
    with pytest.raises(LinkClosedError, match="unplugged"):
        link.write(b"b")


def test_what_is_plugged_in_again_can_be_opened_again_and_goes_on_with_its_faults() -> None:
    device = Echo()
    spec = FaultSpec.parse("drop:0.5,unplug:0.05+0.1")
    link = FaultyLink(MemoryLink(device), spec, seed=1, clock=device, split=split_frames)
    with pytest.raises(LinkClosedError, match="unplugged"):
        link.read(1.0)
    link.close()
    inner = MemoryLink(device)
    opened: list[Link] = []

    def opener() -> Link:
        opened.append(inner)
        return inner

    with pytest.raises(LinkOpenError, match="unplugged"):
        link.open_again(opener)
    assert opened == []
    MemoryLink(device).read(0.2)
    link.open_again(opener)
    before = link.down.frames
    link.write(b"".join(frames(40)))
    assert link.read(1.0)
    link.read(2.0)  # it was unplugged once, and is not again
    assert (link.down.frames - before, opened) == (40, [inner])
    assert 0 < link.down.dropped < 40
    link.close()
    inner.close()


def test_what_is_unplugged_for_good_cannot_be_opened_again() -> None:
    device = Echo()
    link = FaultyLink(MemoryLink(device), FaultSpec(unplug=0.0), seed=1, clock=device)
    link.close()
    with pytest.raises(LinkOpenError, match="unplugged"):
        link.open_again(lambda: MemoryLink(device))


@pytest.mark.parametrize("spec", ["drop:0.1,corrupt:0.1,duplicate:0.1,delay:0.01,jitter:0.02", "jitter:0.05,reorder"])
def test_the_same_seed_does_the_same(spec: str) -> None:
    assert one_way(spec, 500)[1] == one_way(spec, 500)[1]
    assert one_way(spec, 500)[1] != one_way(spec, 500, seed=4)[1]


def test_each_way_has_its_own_luck() -> None:
    device = Echo()
    link = FaultyLink(MemoryLink(device), FaultSpec(), FaultSpec(drop=1.0), seed=1, clock=device, split=split_frames)
    link.write(frames(1)[0])
    assert link.read(0.1) == b""
    assert (link.down.dropped, link.up.dropped) == (0, 1)
    assert device.came


def test_without_a_splitter_a_piece_is_damaged_anywhere() -> None:
    device = Echo()
    link = FaultyLink(MemoryLink(device), FaultSpec(corrupt=1.0), FaultSpec(), seed=1, clock=device)
    for _ in range(50):
        link.write(b"\0")
        link.read(0.005)
    came = {data for _, data in device.came}
    assert b"\0" not in came
    assert len(came) > 5


class Stuck(Link):
    """A link whose other end takes nothing, or is gone."""

    url = "stuck:"

    def __init__(self, error: type[LinkTimeoutError | LinkClosedError]) -> None:
        self.error = error

    def write(self, data: bytes) -> None:
        raise self.error(self.url, f"{len(data)} bytes too many")

    def read(self, timeout: float) -> bytes:
        del timeout
        return b""

    def close(self) -> None:
        pass


def test_a_late_frame_that_is_not_taken_is_lost_and_no_error_of_the_reader() -> None:
    clock = ManualClock()
    link = FaultyLink(Stuck(LinkTimeoutError), FaultSpec(delay=0.01), seed=1, clock=clock)
    link.write(b"x")
    clock.advance(0.02)
    assert link.read(0) == b""
    with pytest.raises(LinkTimeoutError):
        FaultyLink(Stuck(LinkTimeoutError), FaultSpec(), seed=1, clock=clock).write(b"x")


def test_a_late_frame_that_finds_the_link_gone_tells_the_reader() -> None:
    clock = ManualClock()
    link = FaultyLink(Stuck(LinkClosedError), FaultSpec(delay=0.01), seed=1, clock=clock)
    link.write(b"x")
    clock.advance(0.02)
    with pytest.raises(LinkClosedError, match="too many"):
        link.read(0)


class Loop(Link):
    """A link that brings back what was written, for one thread that reads and one that writes."""

    url = "loop:"

    def __init__(self) -> None:
        self._data = b""
        self._there = threading.Condition()

    def write(self, data: bytes) -> None:
        with self._there:
            self._data += data
            self._there.notify()

    def read(self, timeout: float) -> bytes:
        with self._there:
            self._there.wait_for(lambda: self._data, timeout)
            data, self._data = self._data, b""
            return data

    def close(self) -> None:
        pass


def test_one_thread_writes_while_another_reads() -> None:
    link = FaultyLink(Loop(), FaultSpec(delay=0.001, jitter=0.002), seed=1, clock=MonotonicClock(), split=split_frames)
    sent = frames(300)

    def write() -> None:
        for frame in sent:
            link.write(frame)

    writer = threading.Thread(target=write)
    writer.start()
    came = b""
    for _ in range(1000):
        came += link.read(1.0)
        if len(came) == sum(map(len, sent)):
            break
    writer.join()
    assert split_frames(came) == sent


@given(
    st.builds(
        FaultSpec,
        drop=st.sampled_from([0.0, 0.05, 1.0]),
        corrupt=st.sampled_from([0.0, 0.01]),
        duplicate=st.sampled_from([0.0, 0.5]),
        delay=st.sampled_from([0.0, 0.02]),
        jitter=st.sampled_from([0.0, 0.02]),
        reorder=st.booleans(),
        unplug=st.sampled_from([0.0, 12.5, 3e7]),
        replug=st.sampled_from([None, 0.0, 2.5, 3e7]),
    )
)
def test_a_specification_survives_being_written_down(spec: FaultSpec) -> None:
    assert FaultSpec.parse(str(spec)) == spec


def test_both_ways_of_writing_a_specification() -> None:
    expected = FaultSpec(drop=0.05, corrupt=0.01, jitter=0.02)
    assert FaultSpec.parse("drop:0.05,corrupt:0.01,jitter:0.02") == expected
    assert FaultSpec.parse("drop=0.05, corrupt=0.01, jitter=0.02,") == expected
    assert FaultSpec.parse("reorder:false") == FaultSpec()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("drop:2", "share of frames"),
        ("drop:-0.1", "share of frames"),
        ("drop:nan", "share of frames"),
        ("delay:-1", "time in s"),
        ("jitter:inf", "time in s"),
        ("drop", "needs a number"),
        ("unplug:1+", "needs a number"),
        ("unplug:1+-2", "time in s"),
        ("replug:1", "unknown fault 'replug'"),
        ("loss:0.1", "unknown fault 'loss'"),
        ("reorder:perhaps", "on or off"),
    ],
)
def test_wrong_specifications_are_refused(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        FaultSpec.parse(text)


def test_nothing_is_plugged_in_that_was_not_unplugged() -> None:
    with pytest.raises(ValueError, match="unplug:T\\+D"):
        FaultSpec(replug=1.0)


def test_heartbeats_are_frames_too() -> None:
    codec = MavlinkCodec(system=1, component=1)
    assert len(split_frames(codec.encode(Heartbeat(10, 0, 0, 0, 3)) * 3)) == 3
