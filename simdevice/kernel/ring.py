"""One ring of the kernel's arrays: what is placed on its table is taken over, what is looked at is shown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.messages import BoutOutcome
from simdevice.arena import Dummy, Rover
from simdevice.junior.device import SYSTEM_BYTE, SYSTEM_MASK
from simdevice.junior.sensors import draw_noise
from simdevice.kernel.arrays import PIECES, SENSORS
from simdevice.kernel.chipmunk import body_address, joint_address, space_address
from simdevice.sumo.match import TIME_LIMIT, opponent_code

if TYPE_CHECKING:
    from simdevice.arena import Piece
    from simdevice.junior.faults import DeviceFaults
    from simdevice.junior.hardware import JuniorHardware
    from simdevice.junior.profile import JuniorProfile
    from simdevice.kernel.arrays import Arrays
    from simdevice.outline import Outline
    from simdevice.sumo.match import Match

_ERRORS: Final = 256
"""Errors of wheel commands drawn at a time."""
_COMMANDS: Final = 2
"""Most of them that a command takes."""


class KernelRing:
    """One ring in the kernel's arrays; piece 0 is Junior, piece 1 its opponent, and device n sits in piece n.

    Args:
        arrays: The kernel's arrays.
        number: Which of their rings it is.
        match: Where everybody is placed.
        wire: What its devices speak.
    """

    def __init__(self, arrays: Arrays, number: int, match: Match, wire: str) -> None:
        self._arrays = arrays
        self.number = number
        self.first = PIECES * number
        self.lib = arrays.lib
        self._ffi = arrays.ffi
        self._match = match
        self._kept: dict[object, object] = {}
        self._numbers: dict[int, Any] = {}
        self._described: dict[int, JuniorProfile] = {}
        self._fed: dict[int, float] = {}
        self._outlines: dict[int, tuple[Outline, Any]] = {}
        self._world, self.devices = arrays.world, arrays.devices
        world, devices = self._world, self.devices
        devices.period_us = round(match.period * 1e6)
        devices.system_at, devices.system_mask = SYSTEM_BYTE[wire], SYSTEM_MASK[wire]
        world.period, world.time_limit = match.period, TIME_LIMIT
        world.half_x, world.half_y = match.half_x, match.half_y
        for piece in range(self.first, self.first + PIECES):
            self._numbers[piece] = world.profile[piece] = self._ffi.new("kernel_profile *")
            devices.fresh[piece] = devices.system[piece] = 1
            devices.effort[2 * piece] = devices.effort[2 * piece + 1] = 1.0
        self._describe(self.first, match.robot)

    @property
    def watched(self) -> bool:
        """Somebody holds on to the match: what is on it is shown after each run, and taken before the next."""
        return self in self._arrays.watched

    @watched.setter
    def watched(self, watched: bool) -> None:
        if watched != self.watched:
            (self._arrays.watched.append if watched else self._arrays.watched.remove)(self)

    def _describe(self, piece: int, robot: JuniorHardware) -> None:
        """Hand over the numbers of a robot, where they are others than before."""
        profile, motors, sensors, to = robot.profile, robot.motors, robot.sensors, self._numbers[piece]
        if self._described.get(piece) is profile:
            return
        self._described[piece] = profile
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
        self.feed(piece, self._fed.get(piece))

    def take(self) -> None:
        """Take over from the table how everybody stands; who has been given other noise begins a bout."""
        match, world = self._match, self._world
        number = self.number
        world.space[number] = self._pointer(space_address(match.arena.space))
        world.lifted[number], world.steps[number], world.outcome[number] = match.lifted, match.steps, int(match.outcome)
        self._arrays.referees.opponent[number] = opponent_code(match.name)
        for piece, one in enumerate((match.robot.body, match.opponent), self.first):
            self._place(piece, one)
        for piece, robot in enumerate((match.robot, match.second), self.first):
            if robot is None:
                continue
            self._describe(piece, robot)
            if self._kept.get(("noise", piece)) is not robot.motors.noise:
                self._kept["noise", piece] = robot.motors.noise
                self._begin(piece)

    def hold_up(self, periods: int) -> None:
        """Hold the robots up.

        Args:
            periods: For so many control periods.
        """
        self._world.lifted[self.number] = periods

    def take_robots(self) -> None:
        """Take over the same, and how far the robots' wheels have come, their bodies, and what is gone from their batteries."""
        world, match = self._world, self._match
        for piece, robot in enumerate((match.robot, match.second), self.first):
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
        self.lib.world_forget(world, piece)
        world.charge[piece], world.voltage[piece] = 0.0, world.full[piece]
        world.share[piece] = world.voltage[piece] * world.profile[piece].per_volt
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
        world, match = self._world, self._match
        robot = match.robot if piece == self.first else match.second
        if robot is None:
            return
        if world.reading_at[piece] >= world.readings[piece]:
            eyes, floor = draw_noise(robot.profile, robot.sensors.noise)
            world.eye_noise[piece] = self._borrowed("eyes", piece, np.ascontiguousarray(eyes), "double[]")
            world.floor_noise[piece] = self._borrowed("floor", piece, floor.astype(np.uint16), "uint16_t[]")
            world.readings[piece], world.reading_at[piece] = eyes.shape[1], 0
        left = world.errors[piece] - world.error_at[piece]
        if left < 2 * _COMMANDS:
            rest = [world.error[piece][world.error_at[piece] + number] for number in range(left)]
            errors = np.concatenate([rest, robot.motors.noise.standard_normal(_ERRORS)])
            world.error[piece] = self._borrowed("errors", piece, errors, "double[]")
            world.errors[piece], world.error_at[piece] = len(errors), 0

    def draw_all(self) -> None:
        """See that every Junior has noise for a control period."""
        for piece in range(self.first, self.first + PIECES):
            self.draw(piece)

    def _borrowed(self, what: str, piece: int, array: np.ndarray[Any, Any], kind: str) -> Any:  # noqa: ANN401 - of cffi
        """A pointer to an array of numpy, which is kept until the next one of its kind."""
        pointer = self._ffi.from_buffer(kind, array)
        self._kept[what, piece] = pointer
        return pointer

    def show(self) -> None:
        """Let the table see what a referee looks at: poses, and how the bout stands."""
        match, world = self._match, self._world
        unpack = self._ffi.unpack
        body, other = match.robot.body, match.opponent
        for name in ("x", "y", "angle", "cos", "sin"):
            values = unpack(getattr(world, name) + self.first, PIECES)
            setattr(body, name, values[0])
            setattr(other, name, values[1])
        match.steps, match.lifted = world.steps[self.number], world.lifted[self.number]
        match.outcome = BoutOutcome(world.outcome[self.number])

    def watch(self) -> None:
        """Somebody looks at the match, and may hold on to it from now on."""
        if not self.watched:
            self.watched = True
            self.show_robots()

    def show_robots(self) -> None:
        """Let the robots on the table show what their wheels, batteries and sensors are at."""
        self.show()
        match, world = self._match, self._world
        for piece, one in enumerate((match.robot.body, match.opponent), self.first):
            if isinstance(one, Dummy):
                one.sliding = bool(world.sliding[piece])
            elif isinstance(one, Rover):
                one.last = (world.last_x[piece], world.last_y[piece], world.last_angle[piece])
                one.held = (world.held_x[piece], world.held_y[piece])
        for piece, robot in enumerate((match.robot, match.second), self.first):
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

    def receive(self, piece: int, data: bytes) -> None:
        """Let a robot receive bytes in the next control period."""
        self.devices.rx[piece] = self._kept["rx", piece] = self._ffi.from_buffer("uint8_t[]", data)
        self.devices.rx_len[piece] = len(data)

    def said_by_second(self) -> bytes:
        """What a second Junior that has a host of its own has said in the last control period."""
        if not self._arrays.loop.stop[self.number] & self.lib.KERNEL_SECOND:
            return b""
        io = self.devices.robot[self.first + 1].io
        return bytes(self._ffi.buffer(io.tx, io.tx_len))

    def answer(self, data: bytes) -> None:
        """Let its referee answer in the next control period."""
        loop = self._arrays.loop
        loop.answer[self.number] = self._kept["answer"] = self._ffi.from_buffer("uint8_t[]", data)
        loop.answer_len[self.number] = len(data)

    def feed(self, piece: int, voltage: float | None) -> None:
        """Have a battery give another voltage, see `Motors.feed`."""
        world, profile = self._world, self._described[piece]
        if voltage is None:
            self._fed.pop(piece, None)
        else:
            self._fed[piece] = voltage
        world.full[piece] = profile.full_voltage if voltage is None else voltage
        world.empty[piece] = profile.empty_voltage if voltage is None else voltage
        world.voltage[piece] = max(world.empty[piece], world.full[piece] - world.charge[piece] * world.profile[piece].fall)
        world.share[piece] = world.voltage[piece] * world.profile[piece].per_volt

    def befall(self, piece: int, faults: DeviceFaults) -> None:
        """Have faults do to a robot what they do now."""
        devices = self.devices
        devices.dark[piece] = faults.dark
        devices.effort[2 * piece], devices.effort[2 * piece + 1] = faults.effort
        for number, (stuck, value) in enumerate(faults.stuck):
            devices.stuck[SENSORS * piece + number] = stuck
            if value is not None:
                devices.reading[SENSORS * piece + number] = value

    def stop_wheels(self, piece: int) -> None:
        """Take a robot's command away, as when its power is cut."""
        self.draw(piece)
        self.lib.world_command(self._world, piece, 0, 0)

    def power_on(self, piece: int) -> None:
        """A robot's board has booted."""
        self.devices.micros[piece] = 0
        self.devices.fresh[piece] = 1
        self.lib.world_power_on(self._world, piece)

    def memory(self, piece: int) -> bytes:
        """What a robot has in its memories: the struct `host_robot`."""
        return bytes(self._ffi.buffer(self.devices.robot[piece]))

    def remember(self, piece: int, memory: bytes, micros: int) -> None:
        """Give a robot back what it had in its memories, and its time since power-on in us."""
        self._ffi.memmove(self.devices.robot[piece], memory, len(memory))
        self.devices.micros[piece], self.devices.fresh[piece] = micros, 0
