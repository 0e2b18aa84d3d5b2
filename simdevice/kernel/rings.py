"""The kernel's arrays, and their owner in Python: what is placed is taken over, what is looked at is shown.

Piece 0 is Junior, piece 1 its opponent; device n sits in piece n. See `world.h` and `devices.h`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Protocol, cast

import numpy as np

from firmware_protocol.messages import BoutOutcome
from simdevice.arena import Dummy, Rover
from simdevice.junior.sensors import draw_noise
from simdevice.kernel.chipmunk import FUNCTIONS, body_address, joint_address, space_address
from simdevice.outline import NOTHING
from simdevice.sumo.table import TIME_LIMIT

if TYPE_CHECKING:
    from simdevice.arena import Piece
    from simdevice.boards import Host
    from simdevice.junior.faults import DeviceFaults
    from simdevice.outline import Outline
    from simdevice.sumo.table import Robot, Table

_PIECES: Final = 2
_SENSORS: Final = 6
"""Eyes, floor sensors, arms."""
_ERRORS: Final = 256
"""Errors of wheel commands drawn at a time."""
_COMMANDS: Final = 2
"""Most of them that a command takes."""


class KernelLibrary(Protocol):
    """What the kernel can do; `loop.h` and `world.h` tell."""

    KERNEL_DUMMY: int
    KERNEL_ROVER: int
    KERNEL_SENT: int
    KERNEL_DECIDED: int
    KERNEL_REBOOTED: int

    def kernel_run(self, loop: object, periods: int) -> int:
        """Live for at most so many control periods."""
        ...

    def kernel_physics_alone(self, loop: object, periods: int) -> None:
        """Step the physics and nothing else."""
        ...

    def world_command(self, world: object, piece: int, left: int, right: int) -> None:
        """Set a Junior's wheels, in permille."""
        ...

    def world_power_on(self, world: object, piece: int) -> None:
        """A Junior's board boots."""
        ...


class Rings:
    """One ring in the kernel's arrays.

    Args:
        host: The build of the firmware and the kernel.
        table: Where everybody is placed.

    Attributes:
        loop: The struct `kernel_loop`.
        devices: The struct `kernel_devices`.
        lib: The kernel's functions and constants.
        sent_something: Bit of `run`'s answer: Junior has sent something.
        decided: Likewise: the bout has been decided.
        rebooted: Likewise: Junior has booted again.
        watched: Somebody holds on to the table: what is on it is to be shown after each run, and taken before the next.
    """

    def __init__(self, host: Host, table: Table) -> None:
        self.lib = cast("KernelLibrary", host.lib)
        self._ffi = ffi = host.ffi
        self._table = table
        self.watched = False
        self._profile = table.robot.profile
        self._kept: dict[object, object] = {}
        self._outlines: dict[int, tuple[Outline, Any]] = {}
        self._world = self._made("kernel_world")
        self.devices = self._made("kernel_devices")
        self.loop = self._made("kernel_loop")
        self.loop.world, self.loop.devices, self.loop.rings = self._world, self.devices, 1
        self.loop.living[0] = 1
        self._run, self._stop = self.lib.kernel_run, self.loop.stop
        self.sent_something, self.decided = self.lib.KERNEL_SENT, self.lib.KERNEL_DECIDED
        self.rebooted = self.lib.KERNEL_REBOOTED
        self.devices.period_us = round(table.period * 1e6)
        world = self._world
        world.period, world.time_limit = table.period, TIME_LIMIT
        world.half_x, world.half_y = table.half_x, table.half_y
        for field, address in FUNCTIONS.items():
            function = ffi.cast(ffi.typeof(getattr(world.physics, field)), address)
            setattr(world.physics, field, function)
        self._describe(table.robot)
        for piece in range(_PIECES):
            for side in range(2):
                self.devices.effort[2 * piece + side] = 1.0
            self.feed(piece, None)

    def _made(self, name: str) -> Any:  # noqa: ANN401 - a struct of cffi
        """A struct whose pointers point to arrays, all zero, that are long enough for whatever they hold of a piece."""
        ffi = self._ffi
        struct = ffi.new(f"{name} *")
        self._kept[name] = struct
        for field, kind in ffi.typeof(name).fields:
            if kind.type.kind == "pointer" and kind.type.item.kind != "struct":
                array = ffi.new(ffi.getctype(kind.type.item, "[]"), _PIECES * _SENSORS)
                self._kept[name, field] = array
                setattr(struct, field, array)
        return struct

    def _describe(self, robot: Robot) -> None:
        """Hand over the numbers of a robot."""
        profile, motors, sensors, to = robot.profile, robot.motors, robot.sensors, self._world.profile
        to.half_track = profile.track / 2
        for name in ("free_speed", "stall_force", "tyre_limit", "idle_current", "resistance", "wheel_gain", "command_noise"):
            setattr(to, name, getattr(profile, name))
        for name in ("slip", "current_per_force", "fall", "per_volt"):
            setattr(to, name, getattr(motors, name))
        for name in ("cone", "steepest", "press", "release", "behind", "floor_step", "floor_beyond_x", "floor_beyond_y"):
            setattr(to, name, getattr(sensors, name))
        to.eye_x, to.eye_y = profile.eye_position
        to.reach, to.eye_offset, to.eye_scale = profile.eye_reach, profile.eye_offset, sensors.scale
        to.arm_span, to.floor_spot = profile.arm_span, profile.floor_spot
        to.floor_x, to.floor_y = profile.floor_position

    def take(self) -> None:
        """Take over from the table how everybody stands; who has been given other noise begins a bout."""
        table, world = self._table, self._world
        world.space[0] = self._pointer(space_address(table.arena.space))
        world.lifted[0], world.steps[0], world.outcome[0] = table.lifted, table.steps, int(table.outcome)
        for piece, one in enumerate((table.robot.body, table.opponent)):
            self._place(piece, one)
        for piece, robot in enumerate((table.robot, table.second)):
            if robot is not None and self._kept.get(("noise", piece)) is not robot.motors.noise:
                self._kept["noise", piece] = robot.motors.noise
                self._begin(piece)

    def take_robots(self) -> None:
        """Take over the same, and how far the robots' wheels have come, their bodies, and what is gone from their batteries."""
        world, table = self._world, self._table
        for piece, robot in enumerate((table.robot, table.second)):
            if robot is not None:
                motors = robot.motors
                world.travel[2 * piece], world.travel[2 * piece + 1] = motors.travel_left, motors.travel_right
                world.ground[piece], world.charge[piece] = robot.body.ground, motors.charge
        self.take()

    def _place(self, piece: int, one: Piece) -> None:
        """Take over a body, its pose and its joints."""
        world = self._world
        world.body[piece] = self._pointer(body_address(one.body))
        world.outline[piece] = self._outline(one.outline)
        for name in ("x", "y", "angle", "cos", "sin"):
            getattr(world, name)[piece] = getattr(one, name)
        if isinstance(one, Rover) and one.axle is not None:
            world.kind[piece] = self.lib.KERNEL_ROVER
            world.axle[piece] = self._pointer(joint_address(one.axle))
            world.last_x[piece], world.last_y[piece], world.last_angle[piece] = one.last
            world.held_x[piece], world.held_y[piece] = one.held
        elif isinstance(one, Dummy) and one.slide is not None and one.turn is not None:
            world.kind[piece] = self.lib.KERNEL_DUMMY
            world.slide[piece] = self._pointer(joint_address(one.slide))
            world.turn[piece] = self._pointer(joint_address(one.turn))
            world.still_slide[piece], world.still_turn[piece] = one.still
            world.kinetic_slide[piece], world.kinetic_turn[piece] = one.kinetic
            world.grip[piece], world.moving[piece], world.sliding[piece] = one.spec.grip, one.moving, one.sliding

    def _begin(self, piece: int) -> None:
        """A Junior begins a bout: full battery, no command, nothing seen, and noise of the bout's own seed."""
        world = self._world
        for wheel in (2 * piece, 2 * piece + 1):
            world.command[wheel], world.effort[wheel] = 0, 0.0
            world.arm[wheel], world.distance[wheel] = 0, NOTHING
        world.charge[piece], world.voltage[piece] = 0.0, world.full[piece]
        world.share[piece] = world.voltage[piece] * world.profile.per_volt
        world.seen_x[piece] = world.seen_y[piece] = NOTHING
        world.seen_cos[piece] = world.seen_sin[piece] = 0.0
        world.readings[piece] = world.reading_at[piece] = world.errors[piece] = world.error_at[piece] = 0

    def _pointer(self, address: int) -> Any:  # noqa: ANN401 - a pointer of cffi
        return self._ffi.cast("void *", address)

    def _outline(self, outline: Outline) -> Any:  # noqa: ANN401 - a struct of cffi
        """An outline as the kernel has it; each is made once.

        Raises:
            ValueError: It has more corners than the kernel has room for.
        """
        if (known := self._outlines.get(id(outline))) is not None:
            return known[1]
        made = self._ffi.new("kernel_outline *")
        if len(outline.corners) > len(made.edge):
            raise ValueError(f"an outline has at most {len(made.edge)} corners in the kernel, not {len(outline.corners)}")
        made.edges, made.corners, made.radius = len(outline.edges), len(outline.corners), outline.radius
        for number, edge in enumerate(outline.edges):
            made.edge[number] = edge
        for number, (x, y) in enumerate(outline.corners):
            made.corner_x[number], made.corner_y[number] = x, y
        if outline.disc is not None:
            made.has_disc = 1
            made.disc_x, made.disc_radius, made.half_angle = outline.disc.x, outline.disc.radius, outline.disc.half_angle
        self._outlines[id(outline)] = (outline, made)
        return made

    def draw(self, piece: int) -> None:
        """See that a Junior has noise for a control period and for a command besides."""
        world, table = self._world, self._table
        robot = table.second if piece else table.robot
        if robot is None:
            return
        if world.reading_at[piece] >= world.readings[piece]:
            eyes, floor = draw_noise(self._profile, robot.sensors.noise)
            world.eye_noise[piece] = self._borrowed("eyes", piece, np.ascontiguousarray(eyes), "double[]")
            world.floor_noise[piece] = self._borrowed("floor", piece, floor.astype(np.uint16), "uint16_t[]")
            world.readings[piece], world.reading_at[piece] = eyes.shape[1], 0
        left = world.errors[piece] - world.error_at[piece]
        if left < 2 * _COMMANDS:
            rest = [world.error[piece][world.error_at[piece] + number] for number in range(left)]
            errors = np.concatenate([rest, robot.motors.noise.standard_normal(_ERRORS)])
            world.error[piece] = self._borrowed("errors", piece, errors, "double[]")
            world.errors[piece], world.error_at[piece] = len(errors), 0

    def _borrowed(self, what: str, piece: int, array: np.ndarray[Any, Any], kind: str) -> Any:  # noqa: ANN401 - of cffi
        """A pointer to an array of numpy, which is kept until the next one of its kind."""
        pointer = self._ffi.from_buffer(kind, array)
        self._kept[what, piece] = pointer
        return pointer

    @property
    def outcome(self) -> int:
        """Of the bout, as `BoutOutcome` numbers it."""
        return int(self._world.outcome[0])

    def run(self, periods: int) -> tuple[int, int]:
        """Live for at most so many control periods, at least one.

        Args:
            periods: How many, 1 or more.

        Returns:
            How many it were, and why it ended before: constants of the kernel.
        """
        while not (done := self._run(self.loop, periods)):
            for piece in range(_PIECES):
                self.draw(piece)
        return done, self._stop[0]

    def show(self) -> None:
        """Let the table see what a referee looks at: poses, and how the bout stands."""
        table, world = self._table, self._world
        unpack = self._ffi.unpack
        body, other = table.robot.body, table.opponent
        body.x, other.x = unpack(world.x, _PIECES)
        body.y, other.y = unpack(world.y, _PIECES)
        body.angle, other.angle = unpack(world.angle, _PIECES)
        body.cos, other.cos = unpack(world.cos, _PIECES)
        body.sin, other.sin = unpack(world.sin, _PIECES)
        table.steps, table.lifted = world.steps[0], world.lifted[0]
        table.outcome = BoutOutcome(world.outcome[0])

    def watch(self) -> None:
        """Somebody looks at the table, and may hold on to it from now on."""
        if not self.watched:
            self.watched = True
            self.show_robots()

    def show_robots(self) -> None:
        """Let the robots on the table show what their wheels, batteries and sensors are at."""
        self.show()
        table, world = self._table, self._world
        for piece, one in enumerate((table.robot.body, table.opponent)):
            if isinstance(one, Dummy):
                one.sliding = bool(world.sliding[piece])
            elif isinstance(one, Rover):
                one.last = (world.last_x[piece], world.last_y[piece], world.last_angle[piece])
                one.held = (world.held_x[piece], world.held_y[piece])
        for piece, robot in enumerate((table.robot, table.second)):
            if robot is None:
                continue
            left, right = 2 * piece, 2 * piece + 1
            motors, sensors = robot.motors, robot.sensors
            robot.body.ground = world.ground[piece]
            motors.commanded = (world.command[left], world.command[right])
            motors.force_left, motors.force_right = world.force[left], world.force[right]
            motors.travel_left, motors.travel_right = world.travel[left], world.travel[right]
            motors.charge, motors.voltage = world.charge[piece], world.voltage[piece]
            sensors.eye_left, sensors.eye_right = world.eye[left], world.eye[right]
            sensors.floor_left, sensors.floor_right = world.floor[left], world.floor[right]
            sensors.arm_left, sensors.arm_right = world.arm[left], world.arm[right]
            sensors.distance_left, sensors.distance_right = world.distance[left], world.distance[right]

    def sent(self, robot: Any) -> bytes:  # noqa: ANN401 - a struct of cffi
        """What a robot has sent in the last control period."""
        count = robot.io.tx_len
        return self._ffi.buffer(robot.io.tx, count)[:] if count else b""

    def receive(self, piece: int, data: bytes) -> None:
        """Let a robot receive bytes in the next control period."""
        self.devices.rx[piece] = self._kept["rx", piece] = self._ffi.from_buffer("uint8_t[]", data)
        self.devices.rx_len[piece] = len(data)

    def feed(self, piece: int, voltage: float | None) -> None:
        """Have a battery give another voltage, see `Motors.feed`."""
        world, profile = self._world, self._profile
        world.full[piece] = profile.full_voltage if voltage is None else voltage
        world.empty[piece] = profile.empty_voltage if voltage is None else voltage
        world.voltage[piece] = max(world.empty[piece], world.full[piece] - world.charge[piece] * world.profile.fall)
        world.share[piece] = world.voltage[piece] * world.profile.per_volt

    def befall(self, piece: int, faults: DeviceFaults) -> None:
        """Have faults do to a robot what they do now."""
        devices = self.devices
        devices.dark[piece] = faults.dark
        devices.effort[2 * piece], devices.effort[2 * piece + 1] = faults.effort
        for number, (stuck, value) in enumerate(faults.stuck):
            devices.stuck[_SENSORS * piece + number] = stuck
            if value is not None:
                devices.reading[_SENSORS * piece + number] = value

    def stop_wheels(self, piece: int) -> None:
        """Take a robot's command away, as when its power is cut."""
        self.draw(piece)
        self.lib.world_command(self._world, piece, 0, 0)

    def power_on(self, piece: int) -> None:
        """A robot's board has booted."""
        self.devices.micros[piece] = 0
        self.lib.world_power_on(self._world, piece)
