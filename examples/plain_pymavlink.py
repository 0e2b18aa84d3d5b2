"""Speak to Junior with plain pymavlink and its `common` dialect: nothing of this package is imported.

It finds the robot, asks who it is, reads all parameters, sets one and sets it back, arms, drives for a second, presses the
emergency stop, and shows that the robot then refuses to be armed until it is disarmed. It moves: put it on its ring or on
blocks. The robot may be one of yours, or an emulated one that another shell serves:

    hil emulate junior --link tcp://127.0.0.1:5760
    python examples/plain_pymavlink.py tcp:127.0.0.1:5760

    python examples/plain_pymavlink.py /dev/ttyACM0
    python examples/plain_pymavlink.py /dev/pts/3 --baud 115200

All it needs is `pip install pymavlink pyserial`. A serial device or any connection string of pymavlink will do.

It opens no session, as a ground station does not. So it arms without a number (`param3` 0), and any frame of its own keeps the
robot moving: at least every 250 ms, best every 100 ms. pymavlink_session.py is the other way: a session, and ROBOT_ALIVE.
"""

from __future__ import annotations

import argparse
import os
import time
from typing import TYPE_CHECKING, Any

os.environ["MAVLINK20"] = "1"  # looked at when pymavlink is imported: the robot speaks MAVLink 2 only

from pymavlink import mavutil  # type: ignore[import-untyped]

if TYPE_CHECKING:
    from collections.abc import Callable

Message = Any
"""A message of pymavlink, which declares no types."""
STATES = ("disarmed", "ready", "driving", "performing", "countdown", "contest", "stopped")
"""HEARTBEAT.custom_mode of a Junior."""
ROBOT = 1
"""Component id of the robot itself (an emulated one has a referee beside it, 25)."""
SYSTEM, COMPONENT = 255, 190
"""Who we are."""
RESULTS = {0: "accepted", 1: "temporarily rejected", 2: "denied", 3: "unsupported", 4: "failed"}
PATIENCE = 5.0
"""Longest wait for anything, in s."""


class FailedError(Exception):
    """The robot did not do what it should have done."""


def for_us(answer: Message) -> bool:
    """Whether an answer is for us: what a robot has told another says nothing about a command of ours."""
    return answer.target_system in {0, SYSTEM} and answer.target_component in {0, COMPONENT}


class Robot:
    """A vehicle at the other end of a MAVLink connection.

    Args:
        device: Serial device or connection string.
        baud: Rate of a serial port, in bit/s.
    """

    def __init__(self, device: str, baud: int) -> None:
        self.link: Any = mavutil.mavlink_connection(
            device, baud=baud, source_system=SYSTEM, source_component=COMPONENT, dialect="common"
        )
        self.common: Any = mavutil.mavlink
        heartbeat = self.wait("HEARTBEAT", lambda message: bool(message.type == self.common.MAV_TYPE_GROUND_ROVER))
        self.system: int = heartbeat.get_srcSystem()
        print(f"found system {self.system}, {STATES[heartbeat.custom_mode]}")

    def wait(self, kind: str, fits: Callable[[Message], bool] | None = None, patience: float = PATIENCE) -> Message:
        """Wait for a message from the robot.

        Args:
            kind: Name of the message.
            fits: Says whether it is the one.
            patience: Longest wait in s.

        Raises:
            FailedError: It did not come.
        """
        deadline = time.monotonic() + patience
        while (left := deadline - time.monotonic()) > 0:
            message = self.link.recv_match(type=kind, blocking=True, timeout=left)
            if message is not None and message.get_srcComponent() == ROBOT and (fits is None or fits(message)):
                return message
        raise FailedError(f"no {kind} came within {patience:g} s")

    def send(self, command: int, first: float = 0.0, attempt: int = 0) -> None:
        """Send a command once."""
        self.link.mav.command_long_send(self.system, ROBOT, command, attempt, first, 0, 0, 0, 0, 0, 0)

    def command(self, command: int, first: float = 0.0) -> str:
        """Give a command, again if no answer comes, and return the answer in words."""
        for attempt in range(10):
            self.send(command, first, attempt)
            try:
                answer = self.wait("COMMAND_ACK", lambda ack: for_us(ack) and bool(ack.command == command), 0.5)
            except FailedError:
                continue
            return RESULTS[answer.result]
        raise FailedError(f"no answer to command {command}")

    def demand(self, command: int, first: float = 0.0) -> None:
        """Give a command that must be accepted."""
        result = self.command(command, first)
        if result != "accepted":
            raise FailedError(f"command {command} with {first:g} was {result}")

    def state(self) -> str:
        """Ask for a heartbeat, and return the state it tells."""
        self.demand(self.common.MAV_CMD_REQUEST_MESSAGE, self.common.MAVLINK_MSG_ID_HEARTBEAT)
        return STATES[self.wait("HEARTBEAT").custom_mode]

    def arm(self, *, on: bool) -> str:
        """Arm or disarm."""
        return self.command(self.common.MAV_CMD_COMPONENT_ARM_DISARM, 1.0 if on else 0.0)

    def parameters(self) -> dict[str, float]:
        """Read the full list; what got lost is asked for by its index."""
        found: dict[int, Any] = {}
        count = 0
        self.link.mav.param_request_list_send(self.system, ROBOT)
        deadline = time.monotonic() + PATIENCE
        while not count or len(found) < count:
            if time.monotonic() > deadline:
                raise FailedError(f"only {len(found)} of {count} parameters came")
            try:
                value = self.wait("PARAM_VALUE", patience=0.3)
            except FailedError:
                for index in sorted(set(range(count)) - set(found)):
                    self.link.mav.param_request_read_send(self.system, ROBOT, b"", index)
                if not count:
                    self.link.mav.param_request_list_send(self.system, ROBOT)
                continue
            count = value.param_count
            found[value.param_index] = value
        return {found[index].param_id: found[index].param_value for index in sorted(found)}

    def set_parameter(self, name: str, value: float) -> float:
        """Set a parameter, and return the value in force."""
        for _ in range(10):
            self.link.mav.param_set_send(self.system, ROBOT, name.encode(), value, self.common.MAV_PARAM_TYPE_REAL32)
            try:
                answer = self.wait("PARAM_VALUE", lambda message: bool(message.param_id == name), 0.5)
            except FailedError:
                continue
            return float(answer.param_value)
        raise FailedError(f"no answer to setting {name}")

    def drive(self, forward: int, turn: int, duration: float) -> set[str]:
        """Drive as a joystick does, 20 times a second: the robot stops when it has not heard us, who armed it, for 250 ms.

        Args:
            forward: -1000..1000.
            turn: -1000..1000, positive to the right.
            duration: In s.

        Returns:
            The states that its heartbeats told meanwhile.
        """
        states = set()
        end = time.monotonic() + duration
        asked = False
        while (now := time.monotonic()) < end:
            self.link.mav.manual_control_send(self.system, forward, 0, 0, turn, 0)
            if not asked and end - now < duration / 2:  # a heartbeat comes once a second only: ask for one
                asked = True
                self.send(self.common.MAV_CMD_REQUEST_MESSAGE, self.common.MAVLINK_MSG_ID_HEARTBEAT)
            message = self.link.recv_match(type="HEARTBEAT", blocking=True, timeout=0.05)
            if message is not None and message.get_srcComponent() == ROBOT:
                states.add(STATES[message.custom_mode])
        return states


def main() -> None:
    """Go through everything once."""
    parser = argparse.ArgumentParser(description="Find, read, arm, drive and stop a Junior with plain pymavlink.")
    parser.add_argument("device", help="serial device, or a connection string such as tcp:127.0.0.1:5760")
    parser.add_argument("--baud", type=int, default=115200)
    options = parser.parse_args()
    robot = Robot(options.device, options.baud)
    common = robot.common

    robot.demand(common.MAV_CMD_REQUEST_MESSAGE, common.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    version = robot.wait("AUTOPILOT_VERSION")
    firmware, protocol = (f"{v >> 24}.{v >> 16 & 255}" for v in (version.flight_sw_version, version.middleware_sw_version))
    print(f"firmware {firmware}, protocol {protocol}, uid {version.uid:016x}")

    parameters = robot.parameters()
    print(f"{len(parameters)} parameters: {', '.join(parameters)}")
    before = parameters["SPD_SLOW"]
    print(f"SPD_SLOW was {before:.2f}, set to {robot.set_parameter('SPD_SLOW', 0.3):.2f}, ", end="")
    print(f"and back to {robot.set_parameter('SPD_SLOW', before):.2f}")

    print(f"arm: {robot.arm(on=True)}; it is {robot.state()}")
    try:
        states = robot.drive(500, 100, 1.0)
        if "driving" not in states:
            raise FailedError(f"it did not drive, it was {' and '.join(states) or 'silent'}")
        print("drove for a second; its heartbeats said driving")
        robot.drive(500, 100, 0.2)
        robot.demand(common.MAV_CMD_DO_FLIGHTTERMINATION, 1.0)
        print(f"emergency stop while driving: accepted; it is {robot.state()}")
        again = robot.arm(on=True)
        if again == "accepted":
            raise FailedError("it let itself be armed in spite of the emergency stop")
        print(f"arm: {again}, as it should be")
    finally:
        disarmed = robot.arm(on=False)
    print(f"disarm: {disarmed}; arm: {robot.arm(on=True)}; disarm: {robot.arm(on=False)}; it is {robot.state()}")


if __name__ == "__main__":
    try:
        main()
    except FailedError as failure:
        raise SystemExit(f"failed: {failure}") from None
