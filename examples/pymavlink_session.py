"""Command Junior from a program of your own, in a session: with pymavlink and Junior's dialect, and nothing of this package.

It opens a session, arms, performs a maneuver and drives, and keeps the robot moving by ROBOT_ALIVE. Then it begins a long
maneuver and falls silent: the robot stops by itself. At the end it disarms, and believes that when the robot says so. It moves:
put it on its ring or on blocks. The robot may be one of yours, or an emulated one that another shell serves:

    hil emulate junior --link tcp://127.0.0.1:5760
    python examples/pymavlink_session.py tcp:127.0.0.1:5760

    python examples/pymavlink_session.py /dev/ttyACM0 --dialect junior.xml

All it needs is `pip install pymavlink pyserial` and the dialect, `firmware_protocol/dialect/junior.xml`.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import io
import os
import secrets
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

os.environ["MAVLINK20"] = "1"  # looked at when pymavlink is imported: the robot speaks MAVLink 2 only

from pymavlink import mavutil  # type: ignore[import-untyped]
from pymavlink.generator import mavgen  # type: ignore[import-untyped]

if TYPE_CHECKING:
    from collections.abc import Callable

Message = Any
"""A message of pymavlink, which declares no types."""
DIALECT = Path(__file__).parents[1] / "firmware_protocol" / "dialect" / "junior.xml"
SYSTEM, COMPONENT = 255, 190
"""Who we are."""
ROBOT = 1
"""Component id of the robot itself."""
MAJOR, MINOR = 2, 1
"""The protocol that we speak."""
ARM_DISARM, REQUEST_MESSAGE = 400, 512
ALIVE_PERIOD = 0.04
"""Between two ROBOT_ALIVE, in s: the robot stops when it misses them for 0.25 s."""
ANSWER = 0.5
"""What is not answered within this is sent again, in s."""
PATIENCE = 5.0
"""Longest wait for anything, in s."""
TRIES = 10
SPIN_LEFT, STAND = 13, 0
"""Codes of the actions LBRF and S."""


class FailedError(Exception):
    """The robot did not do what it should have done."""


def load(dialect: Path) -> Any:  # noqa: ANN401 - a module that mavgen writes
    """Have pymavlink write the dialect's module, and import it."""
    with tempfile.TemporaryDirectory() as folder:
        options = mavgen.Opts(str(Path(folder) / "junior"), wire_protocol="2.0", language="Python3", validate=False)
        with contextlib.redirect_stdout(io.StringIO()):
            if not mavgen.mavgen(options, [str(dialect)]):
                raise FailedError(f"pymavlink can't read {dialect}")
        sys.path.insert(0, folder)
        try:
            return importlib.import_module("junior")
        finally:
            sys.path.remove(folder)


def for_us(answer: Message) -> bool:
    """Whether an answer is for us: what a robot has told another says nothing about a command of ours."""
    return answer.target_system in {0, SYSTEM} and answer.target_component in {0, COMPONENT}


class Robot:
    """A Junior, and our session with it.

    Args:
        device: Serial device or connection string of pymavlink.
        baud: Rate of a serial port, in bit/s.
        dialect: Junior's dialect, as pymavlink's module.
    """

    def __init__(self, device: str, baud: int, dialect: Any) -> None:  # noqa: ANN401
        self.dialect = dialect
        self.link: Any = mavutil.mavlink_connection(device, baud=baud)
        self.link.mav = dialect.MAVLink(self.link, srcSystem=SYSTEM, srcComponent=COMPONENT)
        self.link.mav.robust_parsing = True
        self.host = secrets.randbelow(0xFFFF) + 1
        self.session = secrets.randbelow(0xFFFF) + 1
        self.sequence = 0
        self.keep = False
        self._alive_due = 0.0
        heartbeat = self.wait("HEARTBEAT", lambda message: bool(message.type == dialect.MAV_TYPE_GROUND_ROVER))
        self.system: int = heartbeat.get_srcSystem()

    @property
    def _target(self) -> dict[str, int]:
        return {"target_system": self.system, "target_component": ROBOT}

    def wait(self, kind: str, fits: Callable[[Message], bool], patience: float = PATIENCE) -> Message:
        """Wait for a message from the robot, and keep it moving meanwhile.

        Args:
            kind: Name of the message.
            fits: Says whether it is the one.
            patience: Longest wait in s.

        Raises:
            FailedError: It did not come.
        """
        deadline = time.monotonic() + patience
        while (now := time.monotonic()) < deadline:
            if self.keep and now >= self._alive_due:
                self._alive_due = now + ALIVE_PERIOD
                self.link.mav.robot_alive_send(self.host, 0, 0)  # to all: those that we have armed know the number
            message = self.link.recv_match(type=kind, blocking=True, timeout=min(ALIVE_PERIOD / 2, deadline - now))
            if message is not None and message.get_srcComponent() == ROBOT and fits(message):
                return message
        raise FailedError(f"no {kind} came within {patience:g} s")

    def command(self, command: int, param1: float, param3: float = 0.0) -> None:
        """Give a command, again if no answer comes.

        Raises:
            FailedError: It was not accepted.
        """
        for attempt in range(TRIES):
            self.link.mav.command_long_send(self.system, ROBOT, command, attempt, param1, 0, param3, 0, 0, 0, 0)
            try:
                ack = self.wait("COMMAND_ACK", lambda message: for_us(message) and bool(message.command == command), ANSWER)
            except FailedError:
                continue
            if ack.result != self.dialect.MAV_RESULT_ACCEPTED:
                raise FailedError(f"command {command} got the result {ack.result}")
            return
        raise FailedError(f"no answer to command {command}")

    def check_version(self) -> str:
        """Read the version of the protocol; with another major one nothing else may be said.

        Raises:
            FailedError: It can't be spoken to.
        """
        self.command(REQUEST_MESSAGE, self.dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
        version = self.wait("AUTOPILOT_VERSION", lambda _: True).middleware_sw_version
        major, minor = version >> 24, version >> 16 & 255
        if major != MAJOR:
            raise FailedError(f"it speaks protocol {major}.{minor}, this program {MAJOR}.{MINOR}")
        return f"{major}.{minor}"

    def numbered(self, message: Message) -> None:
        """Send a numbered message, the very same again if no answer comes: the robot never does it twice.

        Raises:
            FailedError: It was refused.
        """

        def ours(ack: Message) -> bool:
            return for_us(ack) and (ack.message, ack.session, ack.sequence) == wanted

        wanted = (message.get_msgId(), message.session, message.sequence)
        for _ in range(TRIES):
            self.link.mav.send(message)
            try:
                ack = self.wait("ROBOT_ACK", ours, ANSWER)
            except FailedError:
                continue
            if ack.result != self.dialect.ROBOT_ACK_RESULT_ACCEPTED:
                raise FailedError(f"{message.get_type()} was refused, reason {ack.reason}")
            return
        raise FailedError(f"no answer to {message.get_type()}")

    def open(self) -> None:
        """Open our session: the robot stops and disarms."""
        encode = self.link.mav.robot_session_encode
        self.numbered(encode(self.session, 0, self.host, **self._target, major=MAJOR, minor=MINOR))

    def arm(self) -> None:
        """Arm, as who holds the session; from now on ROBOT_ALIVE keeps it moving, and nothing else of ours but orders."""
        self.command(ARM_DISARM, 1, float(self.host))
        self.keep = True

    def disarm(self) -> None:
        """Disarm, and wait until the robot itself says so."""
        self.keep = False
        self.command(ARM_DISARM, 0)
        self.command(REQUEST_MESSAGE, self.dialect.MAVLINK_MSG_ID_HEARTBEAT)
        armed = self.dialect.MAV_MODE_FLAG_SAFETY_ARMED
        self.wait("HEARTBEAT", lambda message: not message.base_mode & armed)

    def perform(self, actions: list[int], period: float) -> None:
        """Begin a maneuver, which the robot times by itself.

        Args:
            actions: Up to eight codes.
            period: Time of each, in s.
        """
        self.sequence += 1
        codes = actions + [0] * (8 - len(actions))
        encode = self.link.mav.junior_maneuver_encode
        self.numbered(
            encode(self.session, self.sequence, round(period * 1e3), 0, **self._target, count=len(actions), actions=codes)
        )

    def result(self) -> Message:
        """Wait for the result of the last maneuver, and say that it has arrived."""

        def ours(result: Message) -> bool:
            return for_us(result) and (result.session, result.sequence) == (self.session, self.sequence)

        result = self.wait("JUNIOR_MANEUVER_RESULT", ours)
        self.link.mav.robot_result_ack_send(self.session, self.sequence, **self._target)
        return result

    def drive(self, left: float, right: float, duration: float) -> None:
        """Turn the wheels: shares of full speed, -1..1, for so many s."""
        self.sequence += 1
        speed = [round(left * 1e3), round(right * 1e3)]
        encode = self.link.mav.junior_wheels_encode
        self.numbered(encode(self.session, self.sequence, speed, round(duration * 1e3), **self._target))


def move(robot: Robot) -> None:
    """Perform a maneuver, drive, and let the robot stop by itself."""
    dialect = robot.dialect
    robot.perform([SPIN_LEFT, SPIN_LEFT, STAND], 0.2)
    result = robot.result()
    if (result.outcome, result.done) != (dialect.JUNIOR_OUTCOME_COMPLETED, 3):
        raise FailedError(f"the maneuver ended by outcome {result.outcome}, reason {result.reason}")
    print("kept by ROBOT_ALIVE, it performed 3 actions")
    robot.drive(0.3, -0.3, 0.2)
    robot.perform([SPIN_LEFT] * 8, 0.5)
    robot.keep = False
    result = robot.result()
    if (result.outcome, result.reason) != (dialect.JUNIOR_OUTCOME_STOPPED, dialect.ROBOT_REASON_WATCHDOG):
        raise FailedError(f"left alone, it ended by outcome {result.outcome}, reason {result.reason}")
    print("left alone, it stopped by itself")


def main() -> None:
    """Go through everything once."""
    parser = argparse.ArgumentParser(description="Open a session with a Junior, and have it move.")
    parser.add_argument("device", help="serial device, or a connection string such as tcp:127.0.0.1:5760")
    parser.add_argument("--baud", type=int, default=115200)
    parser.add_argument("--dialect", type=Path, default=DIALECT, help="junior.xml")
    options = parser.parse_args()
    robot = Robot(options.device, options.baud, load(options.dialect))
    with contextlib.closing(robot.link):
        print(f"found system {robot.system}, protocol {robot.check_version()}")
        robot.open()
        try:
            robot.arm()
            move(robot)
        finally:
            robot.disarm()
        print("disarmed: it says so itself")


if __name__ == "__main__":
    try:
        main()
    except FailedError as failure:
        raise SystemExit(f"failed: {failure}") from None
