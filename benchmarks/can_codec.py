"""Messages per second through the CAN codec, and of one of them through cantools.

Run: `python benchmarks/can_codec.py`.
"""

from __future__ import annotations

from time import perf_counter_ns
from typing import TYPE_CHECKING, Any

from cantools.database import load_file
from cantools.database.can import Database

from firmware_protocol.generate.outputs import ROOT
from firmware_protocol.messages import JuniorSensors, JuniorWheels, Ping
from firmware_protocol.wire.can.dbc import CanCodec

if TYPE_CHECKING:
    from collections.abc import Callable


def main() -> int:
    """Measure and print."""
    host, robot = CanCodec(system=255, component=190), CanCodec(system=1, component=1)
    sensors = JuniorSensors(time=12.345, travel=(0.5, -0.25), eye=(1, 2), floor=(3, 4), battery=7.4, flags=771)
    wheels = JuniorWheels(4711, 12, (0.5, -0.35), 0.25, 1, 1)
    database = load_file(str(ROOT / "firmware_protocol/dialect/junior.dbc"))
    assert isinstance(database, Database)
    oracle = database.get_message_by_name("JUNIOR_WHEELS_FRAME")
    signals: dict[str, Any] = {"sequence": 12, "speed_left": 0.5, "speed_right": -0.35, "duration": 0.25}
    data = robot.encode(sensors)
    question = host.encode(Ping(1, 2))
    jobs: dict[str, Callable[[], object]] = {
        "JUNIOR_WHEELS encoded, one frame": lambda: host.encode(wheels),
        "the same by cantools, strict": lambda: oracle.encode(signals),
        "JUNIOR_SENSORS encoded, three frames": lambda: robot.encode(sensors),
        "JUNIOR_SENSORS decoded": lambda: host.receive(data, 0.0),
        "PING encoded, three frames": lambda: host.encode(Ping(1, 2)),
        "PING decoded": lambda: robot.receive(question, 0.0),
    }
    print(f"{'':42}{'thousand a second':>18}")
    for name, job in jobs.items():
        began = perf_counter_ns()
        for _ in range(20_000):
            job()
        print(f"{name:42}{20_000e6 / (perf_counter_ns() - began):18.0f}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
