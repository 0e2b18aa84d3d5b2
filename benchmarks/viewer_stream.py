"""How late entries of a log go to a viewer while it plays, and whether that adds up.

Streams a log to a viewer of ours that takes everything, over a socket on this machine. Late is by how much an entry goes out
after its moment, which is reckoned from the request to play.

    python benchmarks/viewer_stream.py [--log RUN.mcap] [--seconds 20] [--speed 1]
"""

from __future__ import annotations

import argparse
import sys
from contextlib import suppress
from pathlib import Path
from threading import Thread

import numpy as np

from hil.bridge.clock import MonotonicClock
from hil.look.viewers.recorded import RecordedEntries
from hil.look.viewers.streaming import LogStream

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / "tests" / "support"))
from viewer_client import PLAY, Shown, Told, ViewerClient  # noqa: E402 - needs the above


def main() -> None:
    """Measure, and print a row."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--log", type=Path, default=ROOT / "tests" / "golden" / "small.mcap")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--speed", type=float, default=1.0)
    asked = parser.parse_args()
    late: list[float] = []
    with (
        RecordedEntries(asked.log) as entries,
        LogStream(entries, "log", MonotonicClock(), port=0, sent=late.append) as stream,
        ViewerClient(stream.url) as viewer,
    ):
        viewer.meet()
        viewer.subscribe(viewer.channels)
        last = min(entries.end, entries.begin + round(asked.seconds * asked.speed * 1e9))
        viewer.control(PLAY, speed=asked.speed)
        seen: list[Shown] = []

        def take() -> None:
            with suppress(TimeoutError):
                while True:
                    one = viewer.next(2.0)
                    if isinstance(one, Shown):
                        seen.append(one)
                    if (isinstance(one, Told) and one.status == "ended") or (isinstance(one, int) and one >= last):
                        return

        taking = Thread(target=take)
        taking.start()
        taking.join()
        _print(asked.speed, np.array(late) * 1e3, len(seen))


def _print(speed: float, late: np.ndarray[tuple[int], np.dtype[np.float64]], seen: int) -> None:
    median, most, worst = np.quantile(late, (0.5, 0.99, 1.0))
    begun, over = np.median(late[: len(late) // 10]), np.median(late[-len(late) // 10 :])
    print("speed, entries sent, seen by the viewer; late in ms: median, 99 %, worst; median of the first and the last tenth")
    print(f"{speed:g}x  {len(late):,}  {seen:,}  {median:.3f}  {most:.3f}  {worst:.3f}  {begun:.3f}  {over:.3f}")


if __name__ == "__main__":
    main()
