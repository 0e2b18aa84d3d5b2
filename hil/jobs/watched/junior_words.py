"""What is said of a Junior that is watched: in a line, as plain values, and as facts of a picture."""

from __future__ import annotations

from math import hypot
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import OpponentCode, Phase, RefereeState, SensorFlag, State
from firmware_protocol.messages.referee import BoutOutcome
from firmware_protocol.vocabulary import Stimulus
from hil.cockpit.snapshot import Body, Fact, Figure, PlanView, Senses, Tone
from hil.jobs.words import sensed
from hil.sumo.junior import STIMULUS_BITS

if TYPE_CHECKING:
    from firmware_protocol.messages import JuniorSensors
    from hil.sumo.junior import Junior

OUTCOMES: Final = {BoutOutcome.WIN: "won", BoutOutcome.LOSS: "lost", BoutOutcome.DRAW: "drawn"}
_BODY: Final = 0.05
"""Radius that a robot of the sumo ring is drawn with, in m."""
_COUNTS: Final = 1023.0
"""Greatest count of an eye or a floor sensor."""
ONLY_WATCHED: Final = "only watched"
"""Of a robot that is not ours, as long as no key takes it."""


def cells(junior: Junior) -> tuple[str, ...]:
    """Its line in the table of all: id, state, battery, what it senses, frames, lost, rejected, time to answer.

    Args:
        junior: The robot.
    """
    counters, sensors = junior.peer.counters, junior.latest
    state = junior.state.name.lower() if junior.peer.ready else "NOT HEARD"
    if junior.peer.ready and junior.state is not State.STOPPED and junior.armed:
        state += " (armed)"
    flags = 0 if sensors is None else sensors.flags
    return (
        str(junior.peer.system),
        state,
        "-" if sensors is None else f"{sensors.battery:.2f} V",
        f"({junior.age:.1f} s old)" if sensors is not None and junior.stale else sensed(flags),
        str(counters.good),
        str(counters.lost),
        str(counters.rejected),
        f"{counters.latency * 1000:.1f} ms" if counters.answers else "-",
    )


def line(junior: Junior, sensors: JuniorSensors) -> str:
    """It alone in a line.

    Args:
        junior: The robot.
        sensors: Its latest reading.
    """
    counters = junior.peer.counters
    state = junior.state.name.lower() if junior.peer.ready else "not heard" if junior.bridge.lost is None else "no link"
    return (
        f"{sensors.time:8.2f} s  {state:10}  eyes {sensors.eye[0]:4} {sensors.eye[1]:4}  "
        f"floor {sensors.floor[0]:4} {sensors.floor[1]:4}  battery {sensors.battery:.2f} V  senses {sensed(sensors.flags)}  "
        f"frames {counters.good}, lost {counters.lost}, rejected {counters.rejected}"
        f"{'  ' if (warning := _warning(junior)) else ''}{warning}"
    )


def plain(junior: Junior, sensors: JuniorSensors) -> dict[str, object]:
    """As plain values, for `--json`.

    Args:
        junior: The robot.
        sensors: Its latest reading.
    """
    counters = junior.peer.counters
    return {
        "system": junior.peer.system,
        "state": junior.state.name.lower(),
        "armed": junior.armed,
        "time": sensors.time,
        "age_s": junior.age,
        "stale": junior.stale,
        "eye": list(sensors.eye),
        "floor": list(sensors.floor),
        "travel": list(sensors.travel),
        "battery": sensors.battery,
        "stimulus": Stimulus(sensors.flags & STIMULUS_BITS).label,
        "link": {
            "good": counters.good,
            "lost": counters.lost,
            "rejected": counters.rejected,
            "retries": counters.retries,
            "latency_s": counters.latency if counters.answers else None,
        },
    }


def _warning(junior: Junior) -> str:
    """What makes the readings old; empty when they are not."""
    if not junior.stale:
        return ""
    old = f"these readings are {junior.age:.1f} s old"
    if junior.peer.ready:
        return f"NO READINGS COME, stopped by another client: {old}"
    if junior.bridge.lost is not None:
        return f"LINK LOST, trying to open it again: {old}"
    return f"NOT HEARD ANY MORE: {old}"


def state(junior: Junior) -> tuple[str, Tone]:
    """What it is doing, and how much that matters.

    Args:
        junior: The robot.
    """
    shared = junior.bridge.acquaintances.shared
    if junior.bridge.lost is not None:
        return "LINK LOST, trying to open it again", Tone.ALARM
    if not junior.peer.ready:
        return "NOT HEARD", Tone.ALARM
    if junior.state is State.STOPPED:
        return f"EMERGENCY STOP{f', {shared}' if shared else ': d releases it, then a arms'}", Tone.ALARM
    if junior.armed:
        return f"{junior.state.name} (armed){f', {shared}' if shared else ''}", Tone.WARNING
    return f"{junior.state.name.lower()}{'' if junior.peer.taken else f', {shared or ONLY_WATCHED}'}", Tone.CALM


def facts(junior: Junior) -> tuple[Fact, ...]:
    """What is known of it, line by line.

    Args:
        junior: The robot.
    """
    sensors = junior.latest
    if sensors is None:
        return (Fact("readings", "none yet", tone=Tone.WARNING),)
    age = Fact("readings", f"{junior.age * 1000:.0f} ms old")
    if junior.stale:
        age = Fact("readings", f"{junior.age:.1f} s old", tone=Tone.WARNING)
    flags = SensorFlag(sensors.flags)
    opponent = () if junior.referee is None else (Fact("opponent", OpponentCode(junior.referee.latest.opponent_code).label),)
    return (
        Fact("senses", sensed(sensors.flags), tone=Tone.WARNING if flags & _OFF_RING else Tone.CALM),
        Fact("eye left", str(sensors.eye[0]), sensors.eye[0] / _COUNTS),
        Fact("eye right", str(sensors.eye[1]), sensors.eye[1] / _COUNTS),
        Fact("floor left", str(sensors.floor[0]), sensors.floor[0] / _COUNTS),
        Fact("floor right", str(sensors.floor[1]), sensors.floor[1] / _COUNTS),
        Fact("travel", f"{sensors.travel[0] * 1000:.0f} {sensors.travel[1] * 1000:.0f} mm"),
        Fact("battery", f"{sensors.battery:.2f} V"),
        age,
        *opponent,
    )


_OFF_RING: Final = SensorFlag.OFF_RING_LEFT | SensorFlag.OFF_RING_RIGHT


def ring(word: RefereeState, trail: tuple[tuple[float, float], ...]) -> PlanView:
    """The ring as the referee sees it.

    Args:
        word: What it says.
        trail: Where the robot has been, in m, oldest first.
    """
    bodies = (
        Body(Figure.OPPONENT, word.opponent, word.opponent_heading, _BODY),
        Body(Figure.JUNIOR, word.junior, word.junior_heading, _BODY, chosen=True),
    )
    caption = "b begins a bout"
    if word.phase == Phase.RUNNING:
        caption = f"bout {word.bout}, {word.elapsed:.1f} s"
    elif word.phase == Phase.OVER:
        caption = f"bout {word.bout} {OUTCOMES.get(BoutOutcome(word.outcome), 'over')}; b: another"
    return PlanView(bodies, ring=hypot(*word.opponent) + word.clearance, trail=trail, caption=caption)


def senses(sensors: JuniorSensors) -> Senses:
    """What it senses, where nobody says where it stands.

    Args:
        sensors: Its latest reading.
    """
    flags = SensorFlag(sensors.flags)
    return Senses(
        eyes=(SensorFlag.EYE_LEFT in flags, SensorFlag.EYE_RIGHT in flags),
        arms=(SensorFlag.ARM_LEFT in flags, SensorFlag.ARM_RIGHT in flags),
        off_ring=(SensorFlag.OFF_RING_LEFT in flags, SensorFlag.OFF_RING_RIGHT in flags),
        caption="as the robot senses it",
    )
