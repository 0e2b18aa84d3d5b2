"""Time and memory that a large log costs: what is in it, one topic, a late part; against the `mcap` package's reader.

Makes the log with this package's writer: the traffic of a lock-step bout, second after second, with noise in the bytes, so
that it compresses like a robot's. Every figure is of a process of its own: seconds from its start to its end, those of them
that it computed, with the interpreter's start in both, and its highest resident memory. On a busy machine the second counts.

    python benchmarks/log_reading.py [--size 1000] [--keep LOG]
"""

from __future__ import annotations

import argparse
import random
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter
from typing import Final

from firmware_protocol.messages import Heartbeat, JuniorSensors, RefereeState
from hil.bridge.taps import NOTHING
from hil.mcaplog import LogWriter
from hil.mcaplog.records import BridgeStep, EventRecord, WireBytes
from hil.mcaplog.schemas import message_schema, record_schema
from hil.mcaplog.writing.encode import compile_encoder, sender_suffix, step_encoder, wire_encoder

TOPIC: Final = "/junior/sensors"
SENSORS, STATE, BEAT = (message_schema(kind) for kind in (JuniorSensors, RefereeState, Heartbeat))
STEPS, WIRE, EVENTS = (record_schema(kind) for kind in (BridgeStep, WireBytes, EventRecord))
TASKS: Final[dict[str, str]] = {
    "hil log info": "import hil.cli.app as a; sys.exit(a.run(['log', 'info', log, '--quiet']))",
    f"{TOPIC}, ours": "from hil.mcaplog import LogReader as R; count = sum(1 for _ in R(path).entries([topic]))",
    f"{TOPIC}, the stock reader": (
        "from mcap.reader import make_reader as m; from mcap_protobuf.decoder import DecoderFactory as D\n"
        "with path.open('rb') as file:\n"
        "    count = sum(1 for _ in m(file, decoder_factories=[D()]).iter_decoded_messages([topic]))"
    ),
    "the last minute, ours": (
        "from hil.mcaplog import LogReader as R; count = sum(1 for _ in R(path).entries([topic], start=end - 60.0))"
    ),
    "the last minute, the stock reader": (
        "from mcap.reader import make_reader as m; from mcap_protobuf.decoder import DecoderFactory as D\n"
        "at = int((end - 60.0) * 1e9)\n"
        "with path.open('rb') as file:\n"
        "    count = sum(1 for _ in m(file, decoder_factories=[D()]).iter_decoded_messages([topic], starting_at=at))"
    ),
    "a first entry near the end, ours": (
        "from hil.mcaplog import LogReader as R; count = next(R(path).entries([topic], start=end - 1.0)).time"
    ),
    "every entry, undecoded, ours": "from hil.mcaplog import LogReader as R; count = sum(1 for _ in R(path).raw_entries())",
}
_BEFORE: Final = """
import atexit, sys, resource
from pathlib import Path
log, topic, end, count = sys.argv[1], sys.argv[2], float(sys.argv[3]), "-"
path = Path(log)
def say():
    used = resource.getrusage(resource.RUSAGE_SELF)
    print(used.ru_maxrss, used.ru_utime + used.ru_stime, count)
atexit.register(say)
"""


def make(path: Path, size: int) -> float:
    """Write a log.

    Args:
        path: Where to.
        size: Its size in bytes, about.

    Returns:
        Its last log time in s.
    """
    dice, time = random.Random(1), 0.0  # noqa: S311 - no secret
    writer = LogWriter(path, run={"command": "benchmark"}, flush_every=1.0)
    writer.metadata("config", {"version": "0", "seed": "1"})
    step, sensors, state, beat = step_encoder("sim://junior"), *(compile_encoder(one) for one in (SENSORS, STATE, BEAT))
    event, wire = compile_encoder(EVENTS), {way: wire_encoder(way, "sim://junior") for way in ("rx", "tx")}
    steps, came, went = (
        writer.channel("/bridge/step", STEPS),
        writer.channel("/wire/rx", WIRE),
        writer.channel("/wire/tx", WIRE),
    )
    told = writer.channel("/events", EVENTS)
    writer.write(told, 0.0, event(EventRecord("series", "a very long bout", "{}")))
    tick = 0
    while tick % 1000 or path.stat().st_size < size:
        time = tick * 0.01
        number = tick & 0xFF
        if tick % 2 == 0:
            values = (time, (time, -time), (dice.randrange(1024), dice.randrange(1024)), (41, 42), 7.4 + dice.random(), number)
            data = sensors(JuniorSensors(*values)) + sender_suffix(1, 1, number)
            writer.write(writer.channel(TOPIC, SENSORS), time, data)
        if tick % 5 == 0:
            x = dice.random()
            data = state(RefereeState(time, tick // 800, tick % 800 / 100, (x, 0.1), x, (0.1, x), -x, 0.1, 1, 0, 1))
            writer.write(writer.channel("/referee/state", STATE), time, data + sender_suffix(1, 25, number))
        if tick % 4 == 0:
            writer.write(
                writer.channel("/mavlink/heartbeat", BEAT), time, beat(Heartbeat(6, 8, 0, 0, 4)) + sender_suffix(255, 190)
            )
            writer.write(went, time, wire["tx"](dice.randbytes(21)))
        frame = dice.randbytes(48)
        writer.write(steps, time, step(time, [(time, frame)], NOTHING))
        writer.write(came, time, wire["rx"](frame))
        if tick % 500 == 0:
            writer.write(told, time, event(EventRecord("bout", f"bout {tick // 500}: win after 4.9 s", "{}")))
        tick += 1
    writer.close()
    return time


def measure(code: str, path: Path, end: float) -> tuple[float, float, int, str]:
    """Run a task in a process of its own: seconds, those computed, highest resident memory in bytes, what it counted."""
    begun = perf_counter()
    done = subprocess.run(  # noqa: S603 - our own code
        [sys.executable, "-c", f"{_BEFORE}\n{code}", str(path), TOPIC, str(end)], capture_output=True, text=True, check=False
    )
    took = perf_counter() - begun
    if done.returncode:
        return took, 0.0, 0, f"failed: {done.stderr.strip().splitlines()[-1:]}"
    memory, computed, counted = done.stdout.split()[-3:]
    return took, float(computed), int(memory) * 1024, counted


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=int, default=1000, help="of the log, in MB")
    parser.add_argument("--keep", type=Path, help="where the log is, or is to be kept")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = options.keep or Path(folder) / "large.mcap"
        begun = perf_counter()
        if not path.exists():
            make(path, options.size * 1_000_000)
        from hil.mcaplog.reading.overview import overview  # noqa: PLC0415 - not before the log is written

        found = overview(path)
        print(f"{path.stat().st_size / 1e6:,.0f} MB, {found.entries:,} entries, made in {perf_counter() - begun:.0f} s")
        for name, code in TASKS.items():
            took, computed, memory, counted = measure(code, path, found.end)
            print(f"{name:40} {took:8.2f} s  {computed:8.2f} s computing  {memory / 1e6:6.0f} MB  {counted}", flush=True)


if __name__ == "__main__":
    main()
