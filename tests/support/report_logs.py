"""Small logs made up for the tests of the recorder and the report: no robot, no simulation, numbers known beforehand."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from firmware_protocol.events import PeerBack, PeerFound, PeerLost, Received, Rejected, RejectReason
from firmware_protocol.maneuver_fields import ManeuverReport
from firmware_protocol.messages import (
    AckResult,
    BoutOutcome,
    JuniorManeuver,
    JuniorSensors,
    JuniorWheels,
    OpponentCode,
    ParamValue,
    Phase,
    Reason,
    RefereeState,
    RobotAck,
    SensorFlag,
)
from firmware_protocol.vocabulary import ActionTally, Outcome, Stimulus
from hil.jobs.session import attach
from hil.recording.recorder import Recorder
from hil.runs import ADVICE, CHECKPOINT
from hil.sumo.advice_file import advice_text
from hil.sumo.bouts import Bout
from hil.sumo.coaching import CHECKPOINT_VERSION
from hil.sumo.ring import Encounter
from pal_advisor.maneuvers import Pal, PalSettings, Performance

if TYPE_CHECKING:
    from pathlib import Path

    from firmware_protocol.wire.fields import Message

RUN = {"command": "hil coach --seed 3", "started": "2025-01-02T03:04:05+00:00"}
CONFIG = {"version": "0.1.0", "protocol": "1.0", "seed": "3", "opponent": "flat-light", "objective": "outcome"}
FRAME = bytes(range(40))


@dataclass
class Wire:
    """Feeds a recorder as the bridge would."""

    recorder: Recorder
    now: float = 0.0
    frame: int = 0
    referee_frame: int = 0
    sequence: int = 0

    def up(self, message: Message, component: int = 1) -> None:
        """A frame comes."""
        self.recorder.step(self.now, [(self.now, FRAME)])
        self.recorder.wire_rx(self.now, FRAME)
        frame = self.frame if component == 1 else self.referee_frame
        self.recorder.received(Received(message, 1, component, frame, self.now, FRAME))
        if component == 1:
            self.frame = frame + 1 & 0xFF
        else:
            self.referee_frame = frame + 1 & 0xFF

    def down(self, message: Message) -> None:
        """A message goes."""
        self.recorder.wire_tx(self.now, FRAME)
        self.recorder.sent(self.now, message)

    def command(self, round_trip: float = 0.01) -> None:
        """A maneuver is commanded and acknowledged."""
        self.sequence = self.sequence + 1 & 0xFFFF
        self.down(JuniorManeuver(7, self.sequence, 0.2, 5, 1, 1, 4, (1, 1, 3, 4, 0, 0, 0, 0)))
        self.now += round_trip
        self.up(RobotAck(message_id(JuniorManeuver), 7, self.sequence, 255, 190, AckResult.ACCEPTED, Reason.NONE))


def message_id(kind: type[Message]) -> int:
    """The MAVLink id of a message."""
    return kind.ID


def open_recorder(path: Path, link: str = "memory:") -> Recorder:
    """A recorder with fixed texts."""
    return Recorder(path, run=RUN, config=CONFIG, link=link, lockstep=False)  # many chunks


def coaching_log(path: Path, budget: int = 240, seed: int = 3, *, close: bool = True) -> Recorder:
    """A coaching run against a made-up opponent: forward actions pay, more so when both eyes see."""
    rng = np.random.default_rng(seed)
    settings = PalSettings(budget=budget, population=8)
    pal = Pal(settings, rng)
    recorder = open_recorder(path)
    recorder.metadata("robot", {"uid": "42", "SPD_FAST": "1.0", "SPD_MODERATE": "0.7", "SPD_SLOW": "0.4", "SPD_TURN": "0.35"})
    recorder.event(PeerFound(1, 0.0))
    recorder.series("coaching")
    wire = Wire(recorder)
    number = 0
    while not pal.finished:
        number += 1
        _bout(pal, wire, number, rng)
    advice = pal.advice(opponent="flat-light", seed=seed)
    recorder.advice(advice.to_dict())
    attach(recorder, ADVICE, advice_text(advice).encode())
    attach(recorder, CHECKPOINT, _checkpoint(pal, number, seed))
    if close:
        recorder.close()
    return recorder


def _checkpoint(pal: Pal, bouts: int, seed: int) -> bytes:
    progress = {"bouts": bouts, "wins": 0, "losses": 0, "robot_seconds": 0.8 * pal.used}
    document = {"version": CHECKPOINT_VERSION, "seed": seed, "opponent": "flat-light", **progress, "pal": pal.state_dict()}
    return json.dumps(document).encode()


def _bout(pal: Pal, wire: Wire, number: int, rng: np.random.Generator) -> None:
    recorder = wire.recorder
    x, y, heading = rng.uniform(-0.2, 0.0), rng.uniform(-0.1, 0.1), rng.uniform(-1, 1)
    ox, oy = rng.uniform(0.05, 0.2), rng.uniform(-0.1, 0.1)
    elapsed, previous = 0.0, None
    outcome = BoutOutcome.UNDECIDED
    while outcome is BoutOutcome.UNDECIDED:
        if pal.finished:
            return
        current = int(rng.choice(4, p=[0.5, 0.15, 0.15, 0.2]))
        trial = pal.ask(current, previous)
        recorder.decision(trial)
        wire.command()
        forward = sum(action.spec.left + action.spec.right for action in trial.maneuver.actions) / 8
        start = ox
        for _ in range(16):
            wire.now += 0.05
            elapsed += 0.05
            heading += 0.2 * (math.atan2(oy - y, ox - x) - heading) + rng.normal(0, 0.05)
            x += 0.012 * forward * math.cos(heading)
            y += 0.012 * forward * math.sin(heading)
            if math.hypot(ox - x, oy - y) < 0.09:
                ox += 0.012 * max(0.0, forward)
            outcome = _judge(x, ox, elapsed)
            state = _state(wire.now, number, elapsed, junior=(x, y, heading), other=(ox, oy), outcome=outcome)
            wire.up(state, component=25)
            wire.up(_sensors(wire.now, current, rng))
            if outcome is not BoutOutcome.UNDECIDED:
                break
        pressed = 0.15 if forward > 0 and current == 3 else 0.0
        edges = int(pressed > 0)
        tally = ActionTally(40, (30 * (current & 1), 30 * (current >> 1)), (edges, edges), (pressed, pressed), pressed * 0.1)
        code = int(outcome)
        won, lost = code == BoutOutcome.WIN, code == BoutOutcome.LOSS
        performance = Performance((tally,) * 4, 4, won, lost, ox - start, over=code > 0, duration=0.8)
        report = ManeuverReport(Outcome.COMPLETED, Reason.NONE, 4, (tally,) * 4, Stimulus(current), Stimulus(current))
        encounter = Encounter(report, Stimulus(current), outcome, elapsed, ox - start, 0.8)
        records = pal.tell(trial, performance)
        recorder.trial(trial, encounter, performance, pal.rating)
        assert pal.credited is not None
        recorder.credit(pal.credited)
        for record in records:
            recorder.generation(record)
        previous = current
    recorder.bout(Bout(number, number * 11, outcome, elapsed, 1))
    wire.now += 0.2


def _judge(x: float, ox: float, elapsed: float) -> BoutOutcome:
    if ox > 0.325:
        return BoutOutcome.WIN
    if abs(x) > 0.325:
        return BoutOutcome.LOSS
    return BoutOutcome.DRAW if elapsed >= 15 else BoutOutcome.UNDECIDED


def _state(
    now: float, bout: int, elapsed: float, *, junior: tuple[float, ...], other: tuple[float, float], outcome: BoutOutcome
) -> RefereeState:
    heading = math.remainder(junior[2], math.tau)
    phase = Phase.OVER if outcome else Phase.RUNNING
    return RefereeState(
        now, bout, elapsed, junior[:2], heading, other, 3.1, 0.325 - abs(other[0]), phase, outcome, OpponentCode.FLAT_LIGHT
    )


def _sensors(now: float, stimulus: int, rng: np.random.Generator) -> JuniorSensors:
    eyes = tuple(int(rng.normal(600 if stimulus >> side & 1 else 80, 15)) for side in (0, 1))
    flags = stimulus | SensorFlag.TRAVEL_FROM_ENCODERS | (SensorFlag.ARM_LEFT if now % 4 < 1 else 0)
    floor = (120, 800 if now % 9 > 8 else 130)
    return JuniorSensors(now, (now * 0.1, now * 0.1), eyes, floor, 7.6 - now * 1e-4, int(flags))


def bout_log(path: Path, outcomes: list[tuple[BoutOutcome, float]], opponents: list[OpponentCode] | None = None) -> None:
    """Bouts of given outcomes and durations (s), one opponent each."""
    with open_recorder(path) as recorder:
        wire = Wire(recorder)
        recorder.series("bouts played by the advice")
        for index, (outcome, duration) in enumerate(outcomes):
            opponent = opponents[index] if opponents else OpponentCode.FLAT_HEAVY
            steps = max(2, round(duration / 0.05))
            for step in range(steps + 1):
                elapsed = duration * step / steps
                share = step / steps
                over = step == steps
                state = RefereeState(
                    wire.now, index + 1, elapsed, (-0.2 + 0.3 * share, 0.05 * math.sin(6 * share)), 0.2 * math.sin(6 * share),
                    (0.1 + 0.23 * share, 0.0), 3.0, 0.2, Phase.OVER if over else Phase.RUNNING,
                    outcome if over else BoutOutcome.UNDECIDED, opponent,
                )  # fmt: skip
                wire.up(state, component=25)
                wire.now += 0.05


def driving_log(path: Path, seconds: float = 20.0, silent: tuple[float, float] = (0.0, 0.0)) -> None:
    """Driving by hand, with a link that is lost and comes back, and no readings of the sensors between two times."""
    rng = np.random.default_rng(1)
    with open_recorder(path, "serial:///dev/ttyACM0:115200") as recorder:
        wire = Wire(recorder)
        recorder.event(PeerFound(1, 0.0))
        wire.up(ParamValue("SPD_FAST", 0.9, 9, 24, 0))
        for index in range(round(seconds / 0.02)):
            wire.now = index * 0.02
            if index == 300:
                recorder.event(PeerLost(1, wire.now, "silent for 3 s"))
                recorder.event(PeerBack(1, wire.now, rebooted=True))
            if index % 50 == 10:
                wire.frame = wire.frame + 2 & 0xFF
                recorder.received(Rejected(RejectReason.BAD_CHECKSUM, b"\x01\x02", wire.now))
            if not silent[0] <= wire.now < silent[1]:
                wire.up(_sensors(wire.now, int(wire.now * 2) % 4, rng))
            if index % 25 == 0:
                turn = 0.4 * math.sin(wire.now)
                wire.sequence += 1
                wheels = JuniorWheels(7, wire.sequence, (0.5 + turn, 0.5 - turn), 0.5, 1, 1)
                wire.down(wheels)
                if index % 100 == 0:
                    wire.now += 0.06
                    wire.down(wheels)
                wire.now += 0.004 + 0.002 * rng.random()
                wire.up(RobotAck(JuniorWheels.ID, 7, wire.sequence, 255, 190, AckResult.ACCEPTED, Reason.NONE))


class FullDisk:
    """A file on a disk that has just filled up."""

    def write(self, _data: bytes) -> int:
        """Fail."""
        raise OSError(28, "No space left on device")

    def flush(self) -> None:
        """Nothing is left to flush."""

    def close(self) -> None:
        """Nothing to give back."""
