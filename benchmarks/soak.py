"""Does coaching live through a bad day? Half an hour of it with a fault of some kind every few seconds.

The faults come from a seeded schedule over all kinds that a run may survive: frames lost, damaged, doubled, late, out of
order and too many, unplugged lines, brown-outs, stuck sensors, weak and dead wheels, a low battery. The same coaching without
a fault is run beside it; both advices play the same held-out bouts with a sound robot.

A maneuver that is performed twice is found at the robot: its own counter of the maneuvers it performed since it booted must be
at every report the number of different maneuvers that it has accepted since.

    python benchmarks/soak.py [--seeds 1-4] [--opponent flat-light] [--budget 2800] [--bouts 500]
    python benchmarks/soak.py --real-time 180    # `hil emulate` on a pty, over a serial port
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import subprocess
import sys
import tracemalloc
from collections import Counter
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path
from statistics import mean, stdev
from time import perf_counter
from typing import TYPE_CHECKING, Final

import hil
from firmware_protocol.events import Event, PeerBack, PeerLost, Received, Rejected
from firmware_protocol.faults.spec import FaultSpec
from firmware_protocol.faults.spells import SENSORS, SIDES, Brownout, LineSpell, LowBattery, StuckSensor, Unplug, WeakWheel
from firmware_protocol.links import FaultyLink, MemoryLink
from firmware_protocol.messages import HOST_COMPONENT, HOST_SYSTEM, AckResult, JuniorManeuver, RobotAck, RobotStatus
from firmware_protocol.wire.mavlink import MavlinkCodec, split_frames
from hil.bridge.bridge import Bridge
from hil.bridge.reopening import Reopening
from hil.seeds import Branch, bout_seed, generator
from hil.sumo.bouts import Tally, play
from hil.sumo.coaching import Coaching, new_pal
from hil.sumo.controllers import AdviceController
from hil.sumo.ring import open_ring
from pal_advisor.maneuvers import Advice, PalSettings
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from firmware_protocol.errors import LinkError
    from firmware_protocol.link import Link
    from firmware_protocol.wire.batch import Arrivals
    from firmware_protocol.wire.fields import Message
    from firmware_protocol.wire.rows import Rows
    from hil.bridge.taps import Circumstances, Opening, Tap
    from hil.sumo.bouts import Bout
    from hil.sumo.ring import Encounter
    from pal_advisor.maneuvers import Credit, GenerationRecord, Performance, Trial
    from simdevice.sumo.world import World

PATIENCE: Final = 30.0
"""How long a lost robot is waited for, in s."""
JUDGE: Final = 77
"""Seed of the held-out bouts."""
MINUTE: Final = 60.0
"""In s."""
T95: Final = {1: 12.706, 2: 4.303, 3: 3.182, 4: 2.776, 5: 2.571, 6: 2.447, 7: 2.365, 8: 2.306, 9: 2.262, 11: 2.201, 15: 2.131}
"""97.5 % points of Student's distribution by degrees of freedom."""


# --- what goes wrong -----------------------------------------------------------------------------------------------------


def bad_day(seed: int, seconds: float, *, every: float = 4.0, losses: bool = True) -> FaultSpec:
    """A schedule of faults, one after the other and sometimes two at once, over all kinds in turn.

    Args:
        seed: The same seed is the same day.
        seconds: How long it goes on.
        every: Mean time from one beginning to the next, in s.
        losses: The line is cut and the power fails, too.

    Returns:
        The faults.
    """
    draw = random.Random(f"bad day {seed}")  # noqa: S311 - repeatable, not secret
    kinds = ["drop", "corrupt", "corrupt_bytes", "duplicate", "reorder", "delay", "jitter", "rate", "frame_rate"]
    kinds += ["stuck", "wheel", "battery", *(("unplug", "brownout") if losses else ())]
    ranges = {
        "drop": (0.05, 0.3),
        "corrupt": (0.02, 0.2),
        "corrupt_bytes": (0.02, 0.1),
        "duplicate": (0.1, 0.5),
        "reorder": (0.1, 0.5),
        "delay": (0.005, 0.03),
        "jitter": (0.005, 0.03),
        "rate": (4000.0, 8000.0),
        "frame_rate": (80.0, 200.0),
    }
    spells: list[LineSpell] = []
    unplugs: list[Unplug] = []
    brownouts: list[Brownout] = []
    stuck: list[StuckSensor] = []
    wheels: list[WeakWheel] = []
    batteries: list[LowBattery] = []
    hand: list[str] = []
    at = 2.0
    while at < seconds:
        at = round(at + draw.uniform(0.5 * every, 1.5 * every), 3)
        lasts = round(draw.uniform(0.5, 2.5), 3)
        if not hand:  # every kind comes as often as any other
            hand = draw.sample(kinds, len(kinds))
        match hand.pop():
            case "unplug":
                unplugs.append(Unplug(at=at, lasts=round(lasts / 2, 3)))
            case "brownout":
                brownouts.append(Brownout(at=at, lasts=draw.choice((0.0, round(lasts / 4, 3)))))
            case "stuck":
                sensor = draw.choice(SENSORS)
                value = draw.choice((None, 0, 1 if sensor.startswith("arm") else 1023))
                stuck.append(StuckSensor(sensor, value, at=at, lasts=lasts))
            case "wheel":
                wheels.append(WeakWheel(draw.choice(SIDES), draw.choice((0.0, 0.4, 0.7)), at=at, lasts=lasts))
            case "battery":
                batteries.append(LowBattery(round(draw.uniform(4.5, 6.5), 2), at=at, lasts=lasts))
            case kind:
                low, high = ranges[kind]
                spells.append(LineSpell(kind, round(draw.uniform(low, high), 4), at=at, lasts=lasts))
    return FaultSpec(
        spells=tuple(spells),
        unplugs=tuple(unplugs),
        brownouts=tuple(brownouts),
        stuck=tuple(stuck),
        wheels=tuple(wheels),
        batteries=tuple(batteries),
    )


# --- what is watched -----------------------------------------------------------------------------------------------------


class Witness:
    """Stands between line and robot, where nothing is lost, and counts what the robot accepts and says it performed.

    Args:
        world: The robot's.

    Attributes:
        accepted: Different maneuvers accepted, all boots together.
        performed: Maneuvers performed by the robot's own counter, up to its last report before each restart.
        twice: By how much the counter was ahead of what was accepted, at worst.
        behind: By how much it lagged, at worst.
        reports: How often they were compared.
        boots: Times the robot started.
    """

    def __init__(self, world: World) -> None:
        self.world = world
        self.accepted = self.performed = self.twice = self.behind = self.reports = 0
        self.boots = 1
        self._codec = MavlinkCodec(system=HOST_SYSTEM, component=HOST_COMPONENT)
        self._numbers: set[tuple[int, int]] = set()
        self._counter = 0
        self._uptime = 0.0

    def now(self) -> float:
        """Time of the world, in s."""
        return self.world.now()

    def step(self, inbound: bytes) -> bytes:
        """One control period."""
        out = self.world.step(inbound)
        uptime = self.world.device.uptime
        if uptime < self._uptime:
            self._end_of_boot()
            self.boots += 1
        self._uptime = uptime
        if out:
            for event in self._codec.receive(out, self.now()):
                if isinstance(event, Received) and event.component == 1:
                    self._see(event.message)
        return out

    def finish(self) -> None:
        """The run is over: add up the last boot."""
        self._end_of_boot()

    def _end_of_boot(self) -> None:
        self.accepted += len(self._numbers)
        self.performed += self._counter
        self._numbers.clear()
        self._counter = 0

    def _see(self, message: Message) -> None:
        if isinstance(message, RobotAck):
            if message.message == JuniorManeuver.ID and message.result == AckResult.ACCEPTED:
                self._numbers.add((message.session, message.sequence))
        elif isinstance(message, RobotStatus):
            self.reports += 1
            self._counter = message.maneuvers
            difference = message.maneuvers - len(self._numbers)
            self.twice = max(self.twice, difference)
            self.behind = max(self.behind, -difference)


def resident() -> float:
    """Memory of this process, in MiB (Linux)."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


@dataclass
class Meter:
    """A tap of the bridge that looks at time, memory, and the host's side of things.

    Attributes:
        every: Log time between two looks at the memory, in s.
        memory: (time in s, MiB resident, MiB that Python has allocated where it is traced).
        lost: Times the robot was lost.
        back: Times it was back.
        asked: Maneuvers asked for, as session and sequence, by the robot's boot.
        counted: The robot's counter, as it arrived last, by boot.
        time: Last step, in s.
    """

    every: float = MINUTE
    memory: list[tuple[float, float, float]] = field(default_factory=list)
    lost: int = 0
    back: int = 0
    asked: dict[int, set[tuple[int, int]]] = field(default_factory=dict)
    counted: dict[int, int] = field(default_factory=dict)
    time: float = 0.0
    _due: float = 0.0
    _boot: int = 0

    @property
    def twice(self) -> int:
        """How many more maneuvers the robot has performed in a boot than it was asked for in it, all boots together."""
        return sum(max(0, count - len(self.asked.get(boot, ()))) for boot, count in self.counted.items())

    def step(self, time: float, chunks: Sequence[tuple[float, bytes]], met: Circumstances) -> None:
        """The bridge has begun a step."""
        del chunks, met
        self.time = time
        if time >= self._due:
            self._due = time + self.every
            traced = tracemalloc.get_traced_memory()[0] / 2**20 if tracemalloc.is_tracing() else 0.0
            self.memory.append((time, resident(), traced))

    def of_network(self, name: str) -> Tap:
        """There is one network."""
        del name
        return self

    def opened(self, opening: Opening) -> None:
        """The bridge begins."""

    def session_drawn(self, number: int) -> None:
        """A number was drawn."""

    def wire_rx(self, time: float, data: bytes) -> None:
        """Bytes came."""

    def wire_tx(self, time: float, data: bytes) -> None:
        """Bytes went."""

    def unsent(self, time: float, data: bytes, error: LinkError) -> None:
        """Bytes did not go."""

    def received(self, event: Received | Rejected) -> None:
        """A message was decoded."""
        if isinstance(event, Received) and isinstance(event.message, RobotStatus):
            self._boot = event.message.boot_count
            self.counted[self._boot] = max(self.counted.get(self._boot, 0), event.message.maneuvers)

    def arrived(self, came: Arrivals) -> None:
        """Messages were decoded as arrays: not here."""

    def sent_rows(self, time: float, message: type[Message], rows: Rows) -> None:
        """Messages were sent as arrays: not here."""

    def sent(self, time: float, message: Message) -> None:
        """A message of ours was sent."""
        del time
        if isinstance(message, JuniorManeuver):
            self.asked.setdefault(self._boot, set()).add((message.session, message.sequence))

    def event(self, event: Event) -> None:
        """A robot was lost, or is back."""
        self.lost += isinstance(event, PeerLost)
        self.back += isinstance(event, PeerBack)


# --- lock-step -----------------------------------------------------------------------------------------------------------


class Line:
    """A line with faults to a robot in this process, that can be opened again: see `hil.bridge.reopening.Opener`.

    Args:
        witness: The robot, and who watches it.
        spec: What befalls the line.
        seed: The same seed does the same.
    """

    def __init__(self, witness: Witness, spec: FaultSpec, seed: int) -> None:
        self._witness = witness
        self.link = FaultyLink(MemoryLink(witness), spec, seed=seed, clock=witness, split=split_frames)
        self._first = True

    def open(self) -> Link:
        """Open the link."""
        if not self._first:
            self.link.open_again(lambda: MemoryLink(self._witness))
        self._first = False
        return self.link

    def let_pass(self, duration: float) -> None:
        """Let the robot live on, unheard."""
        end = self._witness.now() + duration - 1e-9
        while self._witness.now() < end:
            self._witness.step(b"")


@dataclass(frozen=True)
class Soaked:
    """One coaching run in lock-step.

    Attributes:
        advice: What was learnt.
        seconds: Simulated time, in s.
        wall: Wall time, in s.
        witness: What the robot did.
        meter: What the host saw.
    """

    advice: Advice
    seconds: float
    wall: float
    witness: Witness
    meter: Meter


def soak(settings: PalSettings, spec: FaultSpec, seed: int, *, opponent: str = "flat-light", every: float = MINUTE) -> Soaked:
    """Coach once, with faults.

    Args:
        settings: How to coach.
        spec: What goes wrong.
        seed: Seed of the coaching and of the faults' chance.
        opponent: Against whom.
        every: Log time between two looks at the memory, in s.
    """
    begun = perf_counter()
    witness = Witness(junior_world(WorldSettings(opponent=opponent, seed=seed, faults=spec)))
    meter = Meter(every)
    line = Line(witness, spec, seed)
    numbers = generator(seed, Branch.SESSION)
    bridge = Bridge(
        line.open(),
        witness,
        taps=[meter],
        session=lambda: int(numbers.integers(1, 0x10000)),
        reopening=Reopening(line, PATIENCE),
    )
    with hil.Junior(bridge) as junior:
        junior.find()
        junior.arm()
        coaching = Coaching(open_ring(junior), new_pal(settings, seed), seed=seed)
        coaching.run()
        junior.wait_until_back()
        junior.status()
    witness.finish()
    advice = coaching.pal.advice(opponent=opponent, seed=seed)
    return Soaked(advice, witness.now(), perf_counter() - begun, witness, meter)


def judged(advice: Advice, opponent: str, bouts: int) -> Tally:
    """Play held-out bouts with a sound robot over a good line.

    Args:
        advice: How to play.
        opponent: Against whom.
        bouts: How many.
    """
    with hil.connect(f"sim://junior?opponent={opponent}&seed=1") as junior:
        junior.arm()
        seeds = [bout_seed(JUDGE, Branch.BOUTS, number) for number in range(1, bouts + 1)]
        return Tally.of(opponent, list(play(open_ring(junior), AdviceController(advice), seeds)))


# --- real time -----------------------------------------------------------------------------------------------------------


@contextlib.contextmanager
def emulator(spec: FaultSpec, seed: int, opponent: str) -> Iterator[str]:
    """`hil emulate` on a pty, as a process of its own.

    Args:
        spec: What goes wrong with the robot and at its end of the line.
        seed: Seed of both.
        opponent: Who stands in the ring.

    Yields:
        The address of the port.
    """
    command = [str(Path(sys.executable).with_name("hil")), "emulate", "junior", "--link", "pty", "--json", "--seed", str(seed)]
    command += ["--opponent", opponent, "--faults", str(spec)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:  # noqa: S603 - our own program
        assert process.stdout is not None
        text = ""
        while not text.endswith("}\n") and (line := process.stdout.readline()):
            text += line
        try:
            yield str(json.loads(text)["url"])
        finally:
            process.terminate()
            process.wait(10)


class EnoughError(Exception):
    """The time is up."""


class Stopwatch:
    """An observer of coaching that ends it.

    Args:
        meter: Reads the clock.
        seconds: When, in s after the first maneuver.
    """

    def __init__(self, meter: Meter, seconds: float) -> None:
        self._meter = meter
        self._seconds = seconds
        self._begun: float | None = None
        self.maneuvers = 0
        self.bouts = 0

    def decision(self, trial: Trial) -> None:
        """A maneuver is asked for."""

    def credit(self, credit: Credit) -> None:
        """Something was credited."""

    def checkpoint(self, used: int, digest: str) -> None:
        """A checkpoint was due."""

    def trial(self, trial: Trial, encounter: Encounter, performance: Performance, fitness: float) -> None:
        """A maneuver was performed."""
        del trial, encounter, performance, fitness
        self.maneuvers += 1
        self._begun = self._meter.time if self._begun is None else self._begun
        if self._meter.time - self._begun >= self._seconds:
            raise EnoughError

    def generation(self, record: GenerationRecord) -> None:
        """A GP step was made."""

    def bout(self, bout: Bout) -> None:
        """A bout ended."""
        del bout
        self.bouts += 1

    def interrupted(self, bout: int, error: str) -> None:
        """The robot was lost."""


def real_time(seconds: float, seed: int, opponent: str) -> tuple[Meter, Stopwatch, FaultSpec]:
    """Coach over a serial port in real time: the plug is pulled at the host's end, all else befalls the emulator.

    Args:
        seconds: How long, in s.
        seed: Seed of everything.
        opponent: Who stands in the ring.
    """
    spec = bad_day(seed, seconds)
    meter = Meter(10.0)
    stopwatch = Stopwatch(meter, seconds)
    pulled = FaultSpec(unplugs=spec.unplugs)
    with (
        emulator(replace(spec, unplugs=()), seed, opponent) as url,
        hil.connect(f"{url}?faults={pulled}&seed={seed}", taps=[meter], reconnect=PATIENCE) as junior,
    ):
        junior.arm()
        coaching = Coaching(open_ring(junior), new_pal(PalSettings(), seed), seed=seed, observers=(stopwatch,))
        with contextlib.suppress(EnoughError):
            coaching.run()
        junior.wait_until_back()
        junior.status()
    return meter, stopwatch, spec


# --- figures -------------------------------------------------------------------------------------------------------------


def growth(memory: Sequence[tuple[float, float, float]], after: float) -> tuple[float, float]:
    """How memory grew once a run was under way.

    Args:
        memory: As `Meter.memory`.
        after: What was before this is warming up, in s.

    Returns:
        MiB resident at that time and at the end.
    """
    late = [resident for time, resident, _ in memory if time >= after]
    return late[0], late[-1]


def in_words(spec: FaultSpec, until: float = inf) -> str:
    """How many faults of which kind began before a time, in s."""
    spells = [spell for spell in spec.all_spells() if spell.at < until]
    kinds = Counter(spell.fault if isinstance(spell, LineSpell) else spell.kind for spell in spells)
    return ", ".join(f"{count} {kind}" for kind, count in sorted(kinds.items()))


def tell_real_time(seconds: float, seed: int, opponent: str) -> None:
    """Run once over a pty, and print."""
    meter, stopwatch, spec = real_time(seconds, seed, opponent)
    asked = sum(map(len, meter.asked.values()))
    performed = sum(meter.counted.values())
    before, after = growth(meter.memory, 30.0 + meter.memory[0][0])
    print(f"seed {seed}: {meter.time - meter.memory[0][0]:.0f} s over a pty; {in_words(spec)}")
    print(f"  {stopwatch.maneuvers} maneuvers rated, {stopwatch.bouts} bouts; lost {meter.lost} times, back {meter.back}")
    print(f"  asked for {asked}, performed {performed} in {len(meter.counted)} boots; more than asked for: {meter.twice}")
    print(f"  resident memory {before:.1f} MiB after 30 s, {after:.1f} MiB at the end", flush=True)


def tell_lockstep(seed: int, opponent: str, budget: int, bouts: int, every: float) -> tuple[float, float]:
    """Run once without faults and once with them, and print.

    Returns:
        Win rates without and with.
    """
    settings = PalSettings(budget=budget)
    sound = soak(settings, FaultSpec(), seed, opponent=opponent)
    spec = bad_day(seed, 2 * sound.seconds, every=every)
    bad = soak(settings, spec, seed, opponent=opponent)
    without, rate = (judged(run.advice, opponent, bouts).win_rate for run in (sound, bad))
    low, high = without.ci95
    witness, meter = bad.witness, bad.meter
    before, after = growth(meter.memory, 5 * MINUTE)
    print(f"seed {seed}: {bad.seconds / MINUTE:.1f} simulated minutes in {bad.wall:.0f} s; {in_words(spec, bad.seconds)}")
    print(f"  without faults {sound.seconds / MINUTE:.1f} minutes in {sound.wall:.0f} s")
    print(f"  held-out: {rate} with, {without} without: {'inside' if low <= rate.value <= high else 'outside'}")
    print(f"  accepted {witness.accepted}, performed {witness.performed} in {witness.boots} boots; the counter was ahead by")
    print(f"  {witness.twice} at most in {witness.reports} reports; lost {meter.lost} times, back {meter.back}")
    print(f"  resident memory {before:.1f} MiB after 5 minutes, {after:.1f} MiB at the end", flush=True)
    return without.value, rate.value


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--opponent", default="flat-light")
    parser.add_argument("--seeds", default="1-4", help="first-last")
    parser.add_argument("--budget", type=int, default=2800, help="maneuvers; so many take half an hour of simulated time")
    parser.add_argument("--bouts", type=int, default=500, help="held-out bouts with each advice")
    parser.add_argument("--every", type=float, default=4.0, help="mean time between the beginnings of faults, in s")
    parser.add_argument("--real-time", type=float, metavar="SECONDS", help="over a pty instead")
    options = parser.parse_args()
    first, _, last = options.seeds.partition("-")
    seeds = range(int(first), int(last or first) + 1)
    if options.real_time:
        for seed in seeds:
            tell_real_time(options.real_time, seed, options.opponent)
        return
    pairs = [tell_lockstep(seed, options.opponent, options.budget, options.bouts, options.every) for seed in seeds]
    if len(pairs) > 1:
        without, rates = zip(*pairs, strict=True)
        half = T95[len(pairs) - 1] * stdev(without) / len(pairs) ** 0.5 if len(pairs) - 1 in T95 else float("nan")
        print(
            f"over seeds: without faults {mean(without):.3f}, 95 % interval of the mean +- {half:.3f}; with {mean(rates):.3f}"
        )


if __name__ == "__main__":
    main()
