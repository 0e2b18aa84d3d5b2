"""What a host says by itself and how often, and how long it does without a word of a robot."""

from __future__ import annotations

from typing import Final

from firmware_protocol.messages import GROUND_STATION, Heartbeat

SILENCE: Final = 3.0
"""A robot not heard for this long is lost, in s."""
HEARTBEAT_PERIOD: Final = 1.0
"""Between our heartbeats, in s."""
KEEP_ALIVE: Final = 0.04
"""Time between two ROBOT_ALIVE while a robot of the network is armed, in s: the watchdog allows 0.25."""
TIMESYNC_PERIOD: Final = 1.0
"""Between comparisons of the clocks, in s."""
HOST_HEARTBEAT: Final = Heartbeat(type=GROUND_STATION, autopilot=8, base_mode=0, custom_mode=0, system_status=4)
"""The host's own."""
