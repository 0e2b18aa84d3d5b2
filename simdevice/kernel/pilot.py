"""Juniors that are driven over the wire by nobody's host: steps of 20 ms, arrays in and arrays out, many rings in a call.

The kernel does what a host would (`pilot.h`): a frame with JUNIOR_WHEELS goes to each robot, and JUNIOR_SENSORS is taken out
of what each sends. The robots run the firmware, and are in a session and armed, as with any host.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Protocol, cast

import numpy as np

from firmware_protocol.messages import (
    HOST_COMPONENT,
    HOST_SYSTEM,
    PROTOCOL_MAJOR,
    PROTOCOL_MINOR,
    ROBOT_COMPONENT,
    Command,
    CommandLong,
    RobotSession,
    State,
)
from firmware_protocol.near import did_you_mean
from firmware_protocol.wire.fields import MAVLINK
from firmware_protocol.wire.mavlink import MavlinkCodec
from simdevice.kernel.arrays import PIECES, Arrays
from simdevice.kernel.world import KernelWorld
from simdevice.sumo.eeprom import NEW_SYSTEM
from simdevice.sumo.opponents import JUNIOR_OPPONENT, OPPONENTS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from simdevice.sumo.settings import WorldSettings

STEP: Final = 0.02
"""A step: the interval of JUNIOR_SENSORS, in s."""
LONGEST_DELAY: Final = 0.1
"""A line that is later than this each way loses a robot whose keeper is silent for 250 ms, in s."""
LONGEST_DURATION: Final = 5.0
"""The longest of JUNIOR_WHEELS, in s."""
_SETTLING: Final = 3
"""Steps from the placing to the first reading that counts: thresholds and debounced switches forget the bout before."""
_SESSION: Final = 1
_HOST: Final = 1
_UNTIL_ARMED: Final = 100
"""Control periods in which a robot is surely armed, and has sent a reading."""


class PilotLibrary(Protocol):
    """What the kernel's pilot can do; `pilot.h` tells."""

    PILOT_NUMBERS: int
    PILOT_REFUSED: int

    def pilot_begin(self, pilot: object, ring: int, sequence: int, frame_sequence: int) -> None:
        """A bout begins."""
        ...

    def pilot_open(self, pilot: object, ring: int) -> None:
        """The last reading is the bout's first."""
        ...

    def pilot_act(self, pilot: object) -> int:
        """Send what the actions say."""
        ...

    def pilot_live(self, pilot: object, periods: int) -> int:
        """Live for at most so many control periods."""
        ...

    def pilot_step(self, pilot: object, periods: int) -> int:
        """Both."""
        ...

    def host_state(self, robot: object) -> int:
        """State that a robot's firmware is in."""
        ...


class PilotedRings:
    """Rings whose Juniors are driven in steps. Time passes in `step`, and in `begin` for those rings that begin.

    Args:
        count: How many rings.
        settings: What each begins with. There is no referee on the wire; who wants to know looks at `outcomes`.
        delay: Time that a frame takes, each way, in s; rounded to control periods.
        duration: How long the wheels go on after a JUNIOR_WHEELS unless the next one comes, in s.

    Attributes:
        actions: What the next step sends, shape (count, 2): left and right wheel, share of full, -1..1; what is beyond is sent
            as the limit. To be set.
        readings: What JUNIOR_SENSORS said last, shape (count, PILOT_NUMBERS), in the wire's counts; see `pilot.h`.
        outcomes: Of each ring's bout, shape (count,), as `BoutOutcome` numbers them.
        periods: Control periods of each ring's bout so far, shape (count,).
        clearances: From each opponent's centre to the border, shape (count,), in m; negative outside.
        living: Rings in which time passes, shape (count,): a bout is begun, and not over.
        period: One control period, in s.

    Raises:
        ValueError: A number is out of range, the robots speak CAN or are to sign, or the opponent is none of the dummies.
    """

    def __init__(self, count: int, settings: WorldSettings, *, delay: float = 0.0, duration: float = 0.1) -> None:
        _check(count, settings, delay, duration)
        self.period = settings.period
        self._periods = round(STEP / settings.period)
        self._arrays = arrays = Arrays(count)
        self._ffi, self._lib = arrays.ffi, cast("PilotLibrary", arrays.lib)
        self.worlds = [KernelWorld(settings, arrays, number) for number in range(count)]
        self.actions = np.zeros((count, 2), np.float32)
        self.readings = np.zeros((count, self._lib.PILOT_NUMBERS), np.float32)
        self.clearances = np.zeros(count, np.float64)
        self.outcomes = self._seen(arrays.world.outcome, count, np.uint8)
        self.periods = self._seen(arrays.world.steps, count, np.uint32)
        self.living = self._seen(arrays.loop.living, count, np.bool_)
        self._pilot = self._make_pilot(count, duration)
        self._step, self._live = self._lib.pilot_step, self._lib.pilot_live
        self._prepare(count)
        self._pilot.delay = round(delay / settings.period)

    def _seen(self, pointer: object, count: int, kind: type[np.generic]) -> NDArray[Any]:
        """An array of the kernel's, of one element a ring, as one of numpy's."""
        return np.frombuffer(self._ffi.buffer(pointer, count * np.dtype(kind).itemsize), kind)

    def _make_pilot(self, count: int, duration: float) -> Any:  # noqa: ANN401 - a struct of cffi
        ffi, codec = self._ffi, MavlinkCodec(system=HOST_SYSTEM, component=HOST_COMPONENT)
        robot = (NEW_SYSTEM, ROBOT_COMPONENT)
        session = codec.encode(RobotSession(_SESSION, 0, _HOST, *robot, PROTOCOL_MAJOR, PROTOCOL_MINOR))
        greeting = session + codec.encode(CommandLong(*robot, Command.ARM_DISARM, param1=1.0, param3=float(_HOST)))
        pilot = ffi.new("kernel_pilot *")
        self._lines = pilot.line = ffi.new("pilot_line[]", count)
        pilot.loop, pilot.session, pilot.duration = self._arrays.loop, _SESSION, round(duration * 1e3)
        pilot.system, pilot.component = HOST_SYSTEM, HOST_COMPONENT
        pilot.robot_system, pilot.robot_component = robot
        pilot.greeting_length = len(greeting)
        self._kept = [
            ffi.new("uint8_t[]", greeting),
            ffi.from_buffer("float[]", self.actions),
            ffi.from_buffer("float[]", self.readings),
            ffi.from_buffer("double[]", self.clearances),
        ]
        pilot.greeting, pilot.action, pilot.reading, pilot.clearance = self._kept
        return pilot

    def _prepare(self, count: int) -> None:
        """Open the sessions and arm the robots; remember them as they are when each has just sent a reading."""
        for line in self._lines:
            line.lost = 1
        self._lib.pilot_act(self._pilot)
        robots = [self._arrays.devices.robot[PIECES * number] for number in range(count)]
        for _ in range(_UNTIL_ARMED):
            self._live_for(1)
            if all(line.heard for line in self._lines) and {self._lib.host_state(robot) for robot in robots} == {State.DRIVING}:
                break
        else:
            raise RuntimeError("an emulated robot does not arm")
        self._moments = [world.device.moment() for world in self.worlds]
        self._numbers = [(line.sequence, line.frame_sequence) for line in self._lines]
        self.living[:] = False

    def begin(self, rings: Sequence[int], seeds: Sequence[int], opponents: Sequence[str] | None = None) -> None:
        """Begin bouts, each at a fresh start pose, and let the robots stand until the first reading that counts is there.

        What follows in a ring depends on the bout's seed, its opponent and the actions, and on nothing that was before.

        Args:
            rings: Their numbers.
            seeds: A seed for each.
            opponents: An opponent for each; None keeps those that are there.

        Raises:
            ValueError: There is no dummy of this name, or a seed is negative.
        """
        check_dummies(opponents or ())
        others = self.living.copy()
        self.living[:] = False
        for index, (ring, seed) in enumerate(zip(rings, seeds, strict=True)):
            self.worlds[ring].begin_bout(seed, None if opponents is None else opponents[index])
            self.worlds[ring].device.return_to(self._moments[ring])
            self._lib.pilot_begin(self._pilot, ring, *self._numbers[ring])
            self.living[ring] = True
            self.actions[ring] = 0.0
        self._live_for(self._pilot.delay)
        for _ in range(_SETTLING):
            self._lib.pilot_act(self._pilot)
            self._live_for(self._periods)
        for ring in rings:
            self._lib.pilot_open(self._pilot, ring)
        self.living |= others

    def step(self) -> None:
        """Send `actions`, and live for a step.

        Raises:
            ValueError: An action is no number.
        """
        if self._arrays.attended:
            if not self._lib.pilot_act(self._pilot):
                raise ValueError(_NO_NUMBER)
            self._live_for(self._periods)
            return
        lived = self._step(self._pilot, self._periods)
        if lived != self._periods:
            if lived == self._lib.PILOT_REFUSED:
                raise ValueError(_NO_NUMBER)
            self._live_for(self._periods - lived)

    def _live_for(self, periods: int) -> None:
        """Let the rings live, faults and all."""
        while periods > 0:
            attended = [one for one in self._arrays.attended if self.living[one.number]]
            most = min([periods, *[one.begin() for one in attended]])
            lived = self._live(self._pilot, most)
            while lived == 0:  # noise is lacking: nobody has lived at all
                self._arrays.draw()
                lived = self._live(self._pilot, most)
            for one in attended:
                one.skip(lived)
            periods -= lived


_NO_NUMBER: Final = "an action is not a number: both wheels' speeds are to be finite, -1 to 1"


def check_dummies(names: Sequence[str]) -> None:
    """See that these are dummies: a second Junior is not driven, and has no memory of a bout's beginning.

    Args:
        names: Names of opponents.

    Raises:
        ValueError: One is not.
    """
    for name in names:
        if name not in OPPONENTS:
            hint = " (a second Junior plays in `hil bout` alone)" if name == JUNIOR_OPPONENT else did_you_mean(name, OPPONENTS)
            raise ValueError(f"no opponent to train against is called {name!r}: choose from {', '.join(OPPONENTS)}{hint}")


def _check(count: int, settings: WorldSettings, delay: float, duration: float) -> None:
    if count < 1:
        raise ValueError(f"there is to be at least one ring, not {count}")
    if settings.wire != MAVLINK or settings.signing_key is not None or settings.board is not None or settings.host is not None:
        raise ValueError("robots that are driven here speak unsigned MAVLink, on the board that comes with the package")
    if settings.referee:
        raise ValueError("there is no referee on the wire here: ask for none")
    if not 0.0 <= delay <= LONGEST_DELAY:
        raise ValueError(f"delay is {delay:g} s: it must lie within 0 and {LONGEST_DELAY:g}")
    if not STEP <= duration <= LONGEST_DURATION:
        raise ValueError(f"duration is {duration:g} s: it must lie within {STEP:g} and {LONGEST_DURATION:g}")
    check_dummies([settings.opponent])
