"""The faulty link: the same seed does the same, and each fault befalls the share of frames it should."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field

import pytest

from firmware_protocol.clock import ManualClock
from firmware_protocol.errors import LinkClosedError, LinkOpenError, LinkTimeoutError
from firmware_protocol.faults.spells import Unplug
from firmware_protocol.link import Link
from firmware_protocol.links import FaultSpec, FaultyLink, MemoryLink
from firmware_protocol.messages import HOST_SYSTEM, Heartbeat, Ping
from firmware_protocol.wire.mavlink import MavlinkCodec, split_frames
from hil.bridge.clock import MonotonicClock


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
    link = FaultyLink(MemoryLink(device), FaultSpec(delay=0.02, unplugs=(Unplug(at=0.05),)), seed=1, clock=device)
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


def test_the_plug_is_pulled_as_often_as_the_specification_says() -> None:
    device = Echo()
    link = FaultyLink(MemoryLink(device), FaultSpec.parse("unplug:1+0.5,unplug:3+0.5,unplug:5"), seed=1, clock=device)
    dead = []
    for _ in range(3):
        with pytest.raises(LinkClosedError, match="unplugged"):
            link.read(10.0)
        dead.append(device.now())
        link.close()
        MemoryLink(device).read(0.6)
        if len(dead) < 3:
            link.open_again(lambda: MemoryLink(device))
    assert dead == pytest.approx([1, 3, 5], abs=0.011)
    with pytest.raises(LinkOpenError, match="unplugged"):
        link.open_again(lambda: MemoryLink(device))


def test_what_is_unplugged_for_good_cannot_be_opened_again() -> None:
    device = Echo()
    link = FaultyLink(MemoryLink(device), FaultSpec(unplugs=(Unplug(at=0.0),)), seed=1, clock=device)
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


def test_a_share_of_frames_leaves_its_place_and_the_others_keep_theirs() -> None:
    link, arrived = one_way("reorder:0.1")
    assert sorted(arrived) == sorted(frames(2000))
    order = {frame: number for number, frame in enumerate(frames(2000))}
    numbers = [order[frame] for frame in arrived]
    passed = [number for place, number in enumerate(numbers) if number < max(numbers[: place + 1])]
    assert 100 <= len(passed) <= 260  # 200 expected to leave, most of them passed by others
    kept = [number for number in numbers if number not in set(passed)]
    assert kept == sorted(kept)
    assert link.down.delayed >= len(passed)


def test_overwritten_bytes_are_one_to_three_anywhere_in_the_frame() -> None:
    device = Echo()
    link = FaultyLink(MemoryLink(device), FaultSpec(corrupt_bytes=1.0), FaultSpec(), seed=1, clock=device, split=split_frames)
    changed, places = set(), set()
    for frame in frames(400):
        link.write(frame)
        link.read(0.005)
        wrong = [place for place, (was, now) in enumerate(zip(frame, device.came[-1][1], strict=True)) if was != now]
        changed.add(len(wrong))
        places.update(wrong)
    assert changed == {1, 2, 3}
    assert {0, 9, len(frames(1)[0]) - 1} <= places  # start marker, message id, checksum


@pytest.mark.parametrize(("spec", "each"), [("rate:2600", 0.0), ("frame_rate:100", 0.01), ("frame_rate:100,rate:1e6", 0.01)])
def test_a_limited_line_carries_one_frame_after_the_other(spec: str, each: float) -> None:
    device = Echo()
    link = FaultyLink(MemoryLink(device), FaultSpec.parse(spec), FaultSpec(), seed=1, clock=device, split=split_frames)
    sent = frames(20)
    for frame in sent:
        link.write(frame)
    link.read(1.0)
    while device.now() < 1.0:
        link.read(0.1)
    times = [time for time, _ in device.came]
    pace = each or len(sent[10]) / 2600
    assert times[-1] - times[4] == pytest.approx(15 * pace, abs=0.011)
    assert split_frames(b"".join(data for _, data in device.came)) == sent


def test_what_a_limited_line_cannot_carry_within_a_second_is_lost() -> None:
    device = Echo()
    link = FaultyLink(MemoryLink(device), FaultSpec(frame_rate=10), FaultSpec(), seed=1, clock=device, split=split_frames)
    link.write(b"".join(frames(40)))
    while device.now() < 6:
        link.read(0.5)
    assert link.down.crowded == 29  # one on its way at once, and as many more as begin within a second
    assert sum(len(split_frames(data)) for _, data in device.came) == 11


def test_a_spell_takes_the_place_of_what_is_always_there_and_gives_it_back() -> None:
    device = Echo()
    spec = FaultSpec.parse("drop:0.1,drop:1@0.5+0.5,drop:0@1.5+0.25")
    link = FaultyLink(MemoryLink(device), spec, FaultSpec(), seed=3, clock=device, split=split_frames)
    sent: dict[str, int] = {"before": 0, "deaf": 0, "between": 0, "whole": 0, "after": 0}
    came = dict(sent)
    for frame in frames(1000):
        now = device.now()
        part = "before" if now < 0.5 else "deaf" if now < 1 else "between" if now < 1.5 else "whole" if now < 1.75 else "after"
        before = len(device.came)
        link.write(frame)
        link.read(0.005)
        sent[part] += 1
        came[part] += len(device.came) - before
    assert came["deaf"] == 0
    assert came["whole"] == sent["whole"] >= 20
    for part in ("before", "between", "after"):
        assert 0.7 * sent[part] < came[part] < sent[part]


def test_begin_and_end_of_what_has_a_time_are_news_once() -> None:
    device = Echo()
    link = FaultyLink(MemoryLink(device), FaultSpec.parse("drop:0.1,jitter:0.02@1+0.5,wheel:left@1.2"), seed=1, clock=device)
    assert link.news() == []
    news = []
    while device.now() < 2:
        link.read(0.1)
        news += [(device.now(), text) for text in link.news()]
    assert [text for _, text in news] == [
        "fault begins: jitter:0.02@1+0.5",
        "fault begins: wheel:left@1.2",
        "fault ends: jitter:0.02@1+0.5",
    ]
    assert [time for time, _ in news] == pytest.approx([1.0, 1.2, 1.5], abs=0.101)  # it is asked every 100 ms


def test_a_spell_of_lateness_leaves_in_real_time_too() -> None:
    clock = ManualClock()
    taken: list[bytes] = []

    class Taking(Stuck):
        def write(self, data: bytes) -> None:
            taken.append(data)

        def read(self, timeout: float) -> bytes:
            clock.advance(timeout)
            return b""

    link = FaultyLink(Taking(LinkClosedError), FaultSpec.parse("delay:0.5@10+1"), seed=1, clock=clock)
    link.write(b"a")
    assert taken == [b"a"]
    clock.advance(10.2)
    link.write(b"b")
    assert taken == [b"a"]
    link.read(0.6)
    assert taken == [b"a", b"b"]


def test_heartbeats_are_frames_too() -> None:
    codec = MavlinkCodec(system=1, component=1)
    assert len(split_frames(codec.encode(Heartbeat(10, 0, 0, 0, 3)) * 3)) == 3
