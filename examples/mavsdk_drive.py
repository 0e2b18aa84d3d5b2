"""See, set up, arm, drive and stop a Junior with MAVSDK: nothing of this package is imported.

It moves: put it on its ring or on blocks. The robot may be one of yours, or an emulated one that another shell serves:

    hil emulate junior --link tcp://127.0.0.1:5760
    python examples/mavsdk_drive.py tcpout://127.0.0.1:5760

    python examples/mavsdk_drive.py serial:///dev/ttyACM0:115200

All it needs is `pip install "mavsdk>=4"`, which brings the whole of MAVSDK in one library.

MAVSDK opens no session, as a ground station does not. So any frame that it sends keeps the robot moving that it has armed: at
least every 250 ms, best every 100 ms.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from typing import Any

from mavsdk import ComponentType, Configuration, Mavsdk  # type: ignore[import-not-found]
from mavsdk.plugins.action import Action, ActionError  # type: ignore[import-not-found]
from mavsdk.plugins.info import Info  # type: ignore[import-not-found]
from mavsdk.plugins.manual_control import ManualControl  # type: ignore[import-not-found]
from mavsdk.plugins.mavlink_direct import MavlinkDirect  # type: ignore[import-not-found]
from mavsdk.plugins.param import Param  # type: ignore[import-not-found]
from mavsdk.plugins.telemetry import Telemetry  # type: ignore[import-not-found]

STATES = ("disarmed", "ready", "driving", "performing", "countdown", "contest", "stopped")
"""HEARTBEAT.custom_mode of a Junior."""
PATIENCE = 5.0
"""Longest wait for anything, in s."""


class FailedError(Exception):
    """The robot did not do what it should have done."""


class Watch:
    """Keeps what a robot's heartbeats say.

    Args:
        system: The robot, as MAVSDK found it.
    """

    def __init__(self, system: Any) -> None:  # noqa: ANN401 - MAVSDK declares no types
        self.states: list[str] = []
        self._direct = MavlinkDirect(system)
        self._direct.subscribe_message("HEARTBEAT", self._take)

    def _take(self, message: Any, _: object) -> None:  # noqa: ANN401
        if message.component_id == 1:
            self.states.append(STATES[int(json.loads(message.fields_json)["custom_mode"])])

    def until(self, state: str) -> None:
        """Wait until its heartbeats tell a state.

        Raises:
            FailedError: They did not.
        """
        deadline = time.monotonic() + PATIENCE
        while not self.states or self.states[-1] != state:
            if time.monotonic() > deadline:
                raise FailedError(f"it is not {state}; its heartbeats said {self.states}")
            time.sleep(0.02)


def drive(control: Any, forward: float, turn: float, duration: float) -> None:  # noqa: ANN401
    """Drive as a joystick does, 20 times a second: the robot stops when it has not heard who armed it for 250 ms.

    Args:
        control: MAVSDK's plugin.
        forward: -1..1.
        turn: -1..1, positive to the right.
        duration: In s.
    """
    end = time.monotonic() + duration
    while time.monotonic() < end:
        control.set_manual_control_input(forward, 0.0, 0.0, turn)
        time.sleep(0.05)


def battery(telemetry: Any) -> float:  # noqa: ANN401
    """Battery voltage in V; it is known from the first SYS_STATUS on, which comes once a second.

    Args:
        telemetry: MAVSDK's plugin.

    Raises:
        FailedError: The robot does not say.
    """
    deadline = time.monotonic() + PATIENCE
    while math.isnan(voltage := float(telemetry.battery().voltage_v)):
        if time.monotonic() > deadline:
            raise FailedError("it does not say how its battery is")
        time.sleep(0.02)
    return voltage


def main() -> None:
    """Go through everything once."""
    parser = argparse.ArgumentParser(description="See, set up, arm, drive and stop a Junior with MAVSDK.")
    parser.add_argument("url", help="MAVSDK's address, as tcpout://127.0.0.1:5760 or serial:///dev/ttyACM0:115200")
    mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    mavsdk.add_any_connection(parser.parse_args().url)
    system = mavsdk.first_autopilot(10.0)
    if system is None:
        raise FailedError("no vehicle was found")
    watch = Watch(system)
    version = Info(system).get_version()
    print(f"found system {system.get_system_id()}, firmware {version.flight_sw_major}.{version.flight_sw_minor}")

    parameters = Param(system)
    names = [parameter.name for parameter in parameters.get_all_params().float_params]
    print(f"{len(names)} parameters, {names[0]} to {names[-1]}")
    before = parameters.get_param_float("SPD_SLOW")
    parameters.set_param_float("SPD_SLOW", 0.3)
    print(f"SPD_SLOW was {before:.2f}, set to {parameters.get_param_float('SPD_SLOW'):.2f}, ", end="")
    parameters.set_param_float("SPD_SLOW", before)
    print(f"and back to {parameters.get_param_float('SPD_SLOW'):.2f}")

    telemetry, action = Telemetry(system), Action(system)
    watch.until("disarmed")
    print(f"battery {battery(telemetry):.1f} V, ready to arm: {telemetry.health().is_armable}")
    action.arm()
    watch.until("ready")
    print(f"armed: {telemetry.armed()}")
    try:
        control = ManualControl(system)
        drive(control, 0.5, 0.1, 1.2)
        watch.until("driving")
        print("drives; its heartbeats say driving")
        watch.until("ready")
        print("left alone, it stopped by itself")
        drive(control, 0.5, 0.0, 0.2)
        action.terminate()
        watch.until("stopped")
        print("emergency stop while driving: it is stopped")
        try:
            action.arm()
        except ActionError:
            print("arming is refused until it is disarmed")
        else:
            raise FailedError("it let itself be armed in spite of the emergency stop")
    finally:
        action.disarm()
    watch.until("disarmed")
    print("disarmed")


if __name__ == "__main__":
    try:
        main()
    except FailedError as failure:
        raise SystemExit(f"failed: {failure}") from None
