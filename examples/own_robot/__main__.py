"""Serve a robot in real time: `python -m own_robot`, in the folder examples/."""

from __future__ import annotations

import argparse
import contextlib
import os
import select
import socket
import time
from pathlib import Path

from own_robot.hardware import Hardware, Store
from own_robot.robot import Robot
from own_robot.tables import TICK
from own_robot.wire import load_dialect

DIALECT = Path(__file__).parents[2] / "firmware_protocol" / "dialect" / "junior.xml"


def serve(robot: Robot, link: str) -> None:
    """Run the robot in real time, on a pty or a TCP port of this machine."""
    if link == "pty":
        master, slave = os.openpty()
        import tty  # noqa: PLC0415 - there is none on Windows

        tty.setraw(slave)
        os.set_blocking(master, False)
        print(f"robot at serial://{os.ttyname(slave)}:115200", flush=True)
    else:
        listener = socket.create_server(("127.0.0.1", int(link.rpartition(":")[2])))
        print(f"robot at tcp://127.0.0.1:{listener.getsockname()[1]}", flush=True)
        client, _ = listener.accept()
        client.settimeout(0)
        master = client.fileno()
    start = following = time.monotonic()
    inbound = b""
    while True:
        following += TICK
        while (left := following - time.monotonic()) > 0:
            if select.select([master], [], [], left)[0]:
                try:
                    data = os.read(master, 4096)
                except OSError:
                    return
                if not data and link != "pty":
                    return
                inbound += data
        out = robot.tick(following - start, inbound)
        inbound = b""
        if out:
            with contextlib.suppress(BlockingIOError):  # nobody reads
                os.write(master, out)


def main() -> None:
    """Serve a robot until it is interrupted or its client hangs up."""
    parser = argparse.ArgumentParser(description="A robot of another make, in Python.")
    parser.add_argument("--link", default="pty" if hasattr(os, "openpty") else "tcp:5760", help="pty, or tcp:PORT")
    parser.add_argument("--store", type=Path, help="file that keeps parameters and memory")
    parser.add_argument("--dialect", type=Path, default=DIALECT, help="junior.xml")
    options = parser.parse_args()
    with contextlib.suppress(KeyboardInterrupt):
        serve(Robot(load_dialect(options.dialect), Hardware(), Store(options.store)), options.link)


if __name__ == "__main__":
    main()
