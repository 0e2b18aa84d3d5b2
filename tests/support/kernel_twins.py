"""One emulated robot twice: in the readable Python world and in the kernel, to which the same is done."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from opening import opening

from firmware_protocol.faults.spec import FaultSpec
from firmware_protocol.messages import (
    HOST_COMPONENT,
    HOST_SYSTEM,
    REFEREE_COMPONENT,
    ROBOT_COMPONENT,
    Command,
    CommandLong,
    ContestCommand,
    JuniorContest,
    JuniorManeuver,
    JuniorMemoryWrite,
    JuniorSensors,
    ManeuverOption,
    OpponentCode,
    ParamSet,
    RefereeReset,
    RefereeState,
    RobotAlive,
)
from firmware_protocol.vocabulary import ANY_STIMULUS, MAX_ACTIONS, Action
from firmware_protocol.wire.codec import open_codec
from firmware_protocol.wire.fields import CAN, MAVLINK
from simdevice.junior.profile import JuniorProfile
from simdevice.junior.second import REFLEXES
from simdevice.kernel.world import KernelWorld
from simdevice.sumo.conditions import CONDITIONS, NOMINAL, Conditions
from simdevice.sumo.settings import WorldSettings
from simdevice.sumo.world import World

if TYPE_CHECKING:
    import random

    from firmware_protocol.wire.fields import Message

Chunks = list[tuple[float, bytes]]
HOST = 7
FAULTS = (
    None,
    "wheel:left:0.37@0.4+0.9,wheel:right",
    "stuck:eye_left:1023@0.2+0.5,stuck:floor_right@0.7,stuck:arm_left:1@1+0.3",
    "brownout:0.6+0.4,brownout:1.5+0.1",
    "battery:5@0.5+0.7,brownout:1.1+0.2,stuck:eye_right@0.3+2",
)


@dataclass
class Twins:
    """The two, and what is done to both.

    Args:
        arguments: As `WorldSettings` takes them.
        watched: Somebody holds on to the kernel's table, so that it is kept up to date.

    Attributes:
        oracle: The Python world; it lives in single periods.
        kernel: The other; it lives in as many at a time as it likes.
        heard: What both have sent, and when.
    """

    arguments: dict[str, Any]
    watched: bool = False
    heard: Chunks = field(default_factory=list)

    def __post_init__(self) -> None:
        self.oracle = World(WorldSettings(**self.arguments))
        self.kernel = KernelWorld(WorldSettings(**self.arguments))

    def live(self, inbound: bytes, periods: int) -> None:
        """Let both live for so many control periods, and compare all that they say and when."""
        first: Chunks = []
        rest = inbound
        for _ in range(periods):
            sent = self.oracle.step(rest)
            rest = b""
            if sent:
                first.append((self.oracle.now(), sent))
        second: Chunks = []
        end, rest = self.oracle.now(), inbound
        while self.kernel.now() < end - 1e-9:
            left = round((end - self.kernel.now()) / self.kernel.period)
            second += self.kernel.run(rest, left)
            rest = b""
        assert second == first
        self.heard += first
        self.compare()

    def compare(self) -> None:
        """Everything that can be looked at from outside is the same."""
        assert self.kernel.now() == self.oracle.now()
        assert self.kernel.nvm == self.oracle.nvm
        assert looks(self.kernel) == looks(self.oracle)
        self.kernel._ring.watched = self.watched


def looks(world: World) -> dict[str, object]:
    """What there is to see of a world."""
    match, device = world.match, world.device
    seen: dict[str, object] = {
        "outcome": match.outcome,
        "elapsed": match.elapsed,
        "lifted": match.lifted,
        "name": match.name,
        "wheels": device.wheels,
        "uptime": device.uptime,
        "powered": device.powered,
        "system": device.system,
    }
    for name, piece in (("junior", match.robot.body), ("other", match.opponent)):
        seen[name] = (piece.x, piece.y, piece.angle, piece.cos, piece.sin, piece.body.velocity, piece.body.angular_velocity)
    for name, robot in (("junior", match.robot), ("second", match.second)):
        if robot is not None:
            motors, sensors = robot.motors, robot.sensors
            seen[f"{name} drive"] = (
                motors.voltage, motors.charge, motors.travel_left, motors.travel_right, motors.force_left, motors.force_right,
                robot.body.ground, motors.commanded,
            )  # fmt: skip
            seen[f"{name} reads"] = (sensors.eye_left, sensors.eye_right, sensors.floor_left, sensors.floor_right)
            seen[f"{name} senses"] = (sensors.distance_left, sensors.distance_right, sensors.arm_left, sensors.arm_right)
    return seen


class Player:
    """Does to both whatever can be done, at random.

    Args:
        rng: Chance.
    """

    def __init__(self, rng: random.Random) -> None:
        self._rng = rng
        self._wire = rng.choice((MAVLINK, MAVLINK, CAN))
        self._sequence = 0
        self._codec = open_codec(self._wire, system=HOST_SYSTEM, component=HOST_COMPONENT)
        faults = rng.choice(FAULTS)
        self.twins = Twins({
            "opponent": rng.choice([code.label for code in OpponentCode if code is not OpponentCode.KEEP]),
            "seed": rng.randrange(1000),
            "referee": rng.random() < 0.8,
            "wire": self._wire,
            "faults": None if faults is None else FaultSpec.parse(faults),
            "start_held": rng.random() < 0.1,
            "profile": self._profile() if rng.random() < 0.5 else JuniorProfile(),
            "period": rng.choice((0.005, 0.005, 0.005, 0.004)),
            "conditions": self._conditions() if rng.random() < 0.3 else NOMINAL,
            "vary": rng.choice((0.0, 0.0, 0.3)),
        }, watched=rng.random() < 0.2)  # fmt: skip

    def _conditions(self) -> Conditions:
        rng = self._rng
        factors = {name: rng.uniform(0.6, 1.4) for name in CONDITIONS if name != "delay"}
        return Conditions(**factors, delay=rng.choice((0.0, 0.02)))

    def _profile(self) -> JuniorProfile:
        rng = self._rng
        return JuniorProfile(
            mass=rng.uniform(0.3, 0.8),
            wheel_gain=(rng.uniform(0.0, 1.2), rng.uniform(0.5, 1.2)),
            command_noise=rng.choice((0.0, 0.05, 0.3)),
            eye_noise=rng.choice((0.0, 3.0, 200.0)),
            eye_angle=rng.uniform(0.0, 0.8),
            floor_spot=rng.choice((0.004, 0.05)),
            encoders=rng.random() < 0.5,
            ground_odometer=rng.random() < 0.5,
        )

    def _next(self) -> int:
        self._sequence += 1
        return self._sequence

    def _say(self) -> list[Message]:
        """What a host may say now."""
        rng = self._rng
        system = self.twins.oracle.device.system
        robot = (system, ROBOT_COMPONENT)
        rare = rng.random() < 0.3
        interval = rng.choice((0.0, 5000.0, 12_000.0, 200_000.0))
        actions = tuple(rng.choice((Action.FF, rng.randrange(17))) for _ in range(4)) + (0,) * 4
        maneuver = JuniorManeuver(77, self._next(), rng.choice((0.05, 0.1, 0.2)), rng.randrange(32), *robot, 4, actions)
        reset = RefereeReset(rng.randrange(1000), 77, self._next(), system, REFEREE_COMPONENT, rng.choice(list(OpponentCode)))
        ask = Command.SET_MESSAGE_INTERVAL
        said: list[list[Message]] = [
            [CommandLong(*robot, Command.ARM_DISARM, param1=0.0)] if rare else self._opening(),
            [ParamSet(*robot, "SYS_ID", float(rng.choice((1, 1, 2))))] if rare else [],
            [CommandLong(*robot, Command.PREFLIGHT_REBOOT, param1=1.0)] if rare else [],
            [CommandLong(system, REFEREE_COMPONENT, ask, param1=float(RefereeState.ID), param2=interval)],
            [CommandLong(*robot, ask, param1=float(JuniorSensors.ID), param2=interval)],
            [reset],
            [*self._opening(), *self._contest()],
        ]
        return rng.choice(said) if rng.random() < 0.6 else [maneuver]

    def _opening(self) -> list[Message]:
        """Open a session and arm."""
        return opening(77, HOST, self.twins.oracle.device.system)

    def _contest(self) -> list[Message]:
        """Teach reflexes that look for the other and charge, and begin a contest."""
        robot = (self.twins.oracle.device.system, ROBOT_COMPONENT)
        said: list[Message] = [ParamSet(*robot, "CONTEST_MAX", 0.0)]
        for stimulus, actions in REFLEXES.items():
            codes = tuple(map(int, actions)) + (0,) * (MAX_ACTIONS - len(actions))
            option, stimulus_code = ManeuverOption.END_ON_CHANGE, int(stimulus)
            write = JuniorMemoryWrite(77, self._next(), 0.1, option, *robot, ANY_STIMULUS, stimulus_code, len(actions), codes)
            said.append(write)
        return [*said, JuniorContest(77, self._next(), 0.0, *robot, ContestCommand.START)]

    def play(self, moves: int) -> None:
        """Do so many things, and compare after each."""
        rng, twins = self._rng, self.twins
        for message in self._opening() + (self._contest() if rng.random() < 0.6 else []):
            twins.live(self._codec.encode(message), 3)
        for _ in range(moves):
            said = self._say()
            if rng.random() < 0.9:
                said.append(RobotAlive(HOST))
            data = b"".join(map(self._codec.encode, said))
            if rng.random() < 0.1:
                data = data[: rng.randrange(len(data) + 1)]
            self._outside()
            twins.live(data, rng.choice((1, 2, 7, 25, 40, 40, 100)))

    def _outside(self) -> None:
        """What others than the host may do to a robot."""
        choice, room = self._rng.randrange(80), self._rng.randrange(200)
        for world in (self.twins.oracle, self.twins.kernel):
            if choice == 0:
                world.switch_off()
            elif choice in {1, 2, 3}:
                world.switch_on()
            elif choice in {4, 5}:
                world.device.set_start(go=choice == 4)
            elif choice == 6:
                world.room = room
            elif choice in {7, 8}:
                world.room = None
            elif choice == 9:
                world.device.power_cycle()
