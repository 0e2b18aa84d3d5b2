"""Gathers what happened in a run, whatever kind of run it was: states, commands to stop, keys, events."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import HOST_SYSTEM, CommandLong, Heartbeat, RobotStatus, Statustext
from firmware_protocol.messages.robot import State
from firmware_protocol.messages.standard import GROUND_STATION, Command
from hil.bridge.operator import KEY
from hil.operator_words import INPUTS, key_words

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.wire.fields import Message

TELLING: Final[frozenset[type[Message]]] = frozenset({Heartbeat, RobotStatus, Statustext})
"""What a robot says of what happened to it."""
SILENCE: Final = 3.0
"""A state counts until the next word of it, for this long at most, in s."""
ASKED_BEFORE: Final = 5.0
"""A stop that was commanded no longer before than this, in s, is the one that a robot says it has made."""
PRESSED_BEFORE: Final = 0.5
"""Likewise for the key that was pressed before a stop was commanded."""
MOST_STRETCHES: Final = 200_000
MOST_HAPPENINGS: Final = 5_000
_OPERATOR: Final = tuple(word.encode() for word in (KEY, *INPUTS))


@dataclass
class Stretch:
    """A time in which a robot was in one state, as far as it said so.

    Attributes:
        state: The state, as in HEARTBEAT.custom_mode.
        start: When it first said so, in s.
        heard: When it last did, in s.
    """

    state: int
    start: float
    heard: float


@dataclass(frozen=True)
class Happening:
    """Something that happened.

    Attributes:
        time: Log time in s.
        kind: What it is of: link, safety, key, operator, robot, ...
        text: What, in words.
    """

    time: float
    kind: str
    text: str


@dataclass
class Stop:
    """An emergency stop.

    Attributes:
        commanded: When it was commanded first, in s; None: it was engaged at the robot itself.
        key: The key that was pressed for it; empty where none was.
        robots: System ids of those that said that they had stopped.
        confirmed: When the first of them did, in s; None: none has.
        released: When the last of them was in another state again, in s; None: never.
    """

    commanded: float | None
    key: str
    robots: set[int]
    confirmed: float | None = None
    released: float | None = None

    @property
    def time(self) -> float:
        """When it was commanded, else when it was told of, in s."""
        return next(time for time in (self.commanded, self.confirmed, math.nan) if time is not None)


class Course:
    """What happened in a run, gathered in order.

    Attributes:
        states: Stretches of each robot, by its system id, in order.
        chapters: Log times in s and titles of what belongs together, as a series of bouts.
        happenings: What happened besides, in order.
        left_out: Happenings that were too many to be kept.
        networks: How many networks the run had: robots of different ones may have the same id.
        questioned: The run asks questions, and takes keys as answers.
    """

    def __init__(self) -> None:
        self.states: dict[int, list[Stretch]] = {}
        self.chapters: list[tuple[float, str]] = []
        self.happenings: list[Happening] = []
        self.left_out: Counter[str] = Counter()
        self.networks = 0
        self.questioned = False
        self._stretches = 0
        self._commanded: list[tuple[float, int]] = []
        self._keys: list[tuple[float, str]] = []

    def happened(self, time: float, kind: str, text: str) -> None:
        """Something happened.

        Args:
            time: Log time in s.
            kind: What it is of.
            text: What, in words.
        """
        if len(self.happenings) < MOST_HAPPENINGS:
            self.happenings.append(Happening(time, kind, text))
        else:
            self.left_out[kind] += 1

    def asked(self, time: float, inputs: Sequence[str], robots: Sequence[str]) -> None:
        """The operator asked for something.

        Args:
            time: Log time in s.
            inputs: For what: interrupt, suspend, continue, key X; anything else tells a report nothing.
            robots: For which robot each is, as far as it is for one.
        """
        for index, what in enumerate(inputs):
            robot = robots[index] if index < len(robots) else ""
            to = f" (robot {robot})" if robot and len(self.states) > 1 else ""
            if what.startswith(KEY):
                key = what.removeprefix(KEY)
                self._keys.append((time, key))
                self.happened(time, "key", f"{key_words(key, questioned=self.questioned)}{to}")
            elif what in INPUTS:
                self.happened(time, "operator", INPUTS[what] + to)

    def sent(self, message: Message | None, time: float) -> None:
        """A message was sent: a command to stop is taken note of.

        Args:
            message: The message; None where it was not read.
            time: Log time in s.
        """
        if isinstance(message, CommandLong) and message.command == Command.FLIGHT_TERMINATION and message.param1 == 1.0:
            last = self._commanded[-1] if self._commanded else (-math.inf, -1)
            if not (message.confirmation and last[1] == message.target_system):  # said again, it is the same stop
                self._commanded.append((time, message.target_system))

    def received(self, message: Message | None, sender: tuple[int, int], time: float) -> None:
        """A robot said something, one of `TELLING` if anything is to be learnt of it.

        Args:
            message: What; None where it was not read.
            sender: System and component.
            time: Log time in s.
        """
        if sender[0] == HOST_SYSTEM:
            return
        if isinstance(message, Heartbeat):
            if message.type != GROUND_STATION and sender[1] == 1:
                self._state(sender[0], message.custom_mode, time)
        elif isinstance(message, RobotStatus):
            self._state(sender[0], message.state, time)
        elif isinstance(message, Statustext):
            self.happened(time, "robot", f"robot {sender[0]}: {message.text}")

    def _state(self, system: int, state: int, time: float) -> None:
        stretches = self.states.setdefault(system, [])
        last = stretches[-1] if stretches else None
        if last is not None and time - last.heard <= SILENCE:
            if state == last.state:
                last.heard = max(last.heard, time)
                return
            last.heard = max(last.heard, time)  # until then it was in the state before, as far as anybody knows
        if self._stretches < MOST_STRETCHES:
            self._stretches += 1
            stretches.append(Stretch(state, time, time))

    def spans(self, system: int, end: float) -> list[tuple[float, float, int]]:
        """From when to when a robot was in which state; where it was silent there is none.

        Args:
            system: Its system id.
            end: When the log ends, in s.

        Returns:
            From, to, both in s, and the state; in order.
        """
        stretches = self.states.get(system, [])
        follow = [*(stretch.start for stretch in stretches[1:]), end]
        return [
            (one.start, max(one.start, min(until, one.heard + SILENCE)), one.state)
            for one, until in zip(stretches, follow, strict=True)
        ]

    def stops(self) -> list[Stop]:
        """Emergency stops, in order: those that were commanded, and those that robots told of."""
        new = [(time, system) for time, system in self._commanded if not self._stopped(system, time)]
        found = [Stop(time, self._key_before(time), set()) for time, _ in new]
        asked = [system for _, system in new]
        stopped = [
            (one.start, stretches[index + 1].start if index + 1 < len(stretches) else None, system)
            for system, stretches in self.states.items()
            for index, one in enumerate(stretches)
            if one.state == State.STOPPED and (not index or stretches[index - 1].state != State.STOPPED)
        ]
        own: list[Stop] = []
        for start, until, system in sorted(stopped, key=lambda stop: stop[0]):
            of = [
                stop
                for stop, to in zip(found, asked, strict=True)
                if to in {0, system} and stop.commanded is not None and 0.0 <= start - stop.commanded <= ASKED_BEFORE
            ]
            stop = of[-1] if of else Stop(None, "", set())
            if not of:
                own.append(stop)
            first = not stop.robots
            stop.robots.add(system)
            stop.confirmed = start if stop.confirmed is None else min(stop.confirmed, start)
            stop.released = until if first else None if until is None or stop.released is None else max(until, stop.released)
        return sorted(_together(found) + own, key=lambda stop: stop.time)

    def _stopped(self, system: int, time: float) -> bool:
        """The robot, each of them for 0, has been stopped already for a while."""
        robots = [system] if system else list(self.states)
        return bool(robots) and all(
            any(one.state == State.STOPPED and one.start < time <= one.heard for one in self.states.get(robot, ()))
            for robot in robots
        )

    def _key_before(self, time: float) -> str:
        return next(
            (key for when, key in reversed(self._keys) if key in {"e", "E"} and 0.0 <= time - when <= PRESSED_BEFORE), ""
        )


def _together(stops: Sequence[Stop]) -> list[Stop]:
    """Stops that were commanded at one moment to several robots, as one."""
    found: list[Stop] = []
    for stop in stops:
        last = found[-1] if found else None
        if last is None or last.time != stop.time:
            found.append(stop)
            continue
        ends = [one.released for one in (last, stop) if one.robots]
        last.robots |= stop.robots
        last.confirmed = min((one for one in (last.confirmed, stop.confirmed) if one is not None), default=None)
        last.released = None if None in ends or not ends else max(end for end in ends if end is not None)
    return found


def of_the_operator(step: bytes) -> bool:
    """A step of the bridge, as a log has it, may hold something that a person asked for: hardly any does.

    Args:
        step: It, not yet decoded.
    """
    return any(word in step for word in _OPERATOR)
