"""Messages per second through the codec, against pymavlink's generated class on the same frames.

Run `python benchmarks/codec.py [--rounds N]`. pymavlink's class is generated from the same dialect, used with
`robust_parsing` and given one frame at a time, as is ours. Both again with every frame signed. Runs are interleaved so that
a busy machine slows both.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import importlib.util
import io
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import TYPE_CHECKING, Any

from firmware_protocol.messages import (
    CommandLong,
    Heartbeat,
    JuniorManeuver,
    JuniorManeuverResult,
    JuniorSensors,
    JuniorWheels,
    ParamValue,
    RobotAck,
    RobotStatus,
    Timesync,
)
from firmware_protocol.wire.mavlink import MavlinkCodec, SignedMavlinkCodec
from firmware_protocol.wire.signing import Signing, SigningKey

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from firmware_protocol.wire.fields import Message

KEY = SigningKey(bytes(range(1, 33)))
ROOT = Path(__file__).resolve().parents[1]

EIGHT = (50, 50, 50, 50, 0, 0, 0, 0)
TRAFFIC: tuple[tuple[Message, int], ...] = (
    (JuniorSensors(12.345678, (0.123, -0.045), (612, 38), (40, 41), 7.42, 261), 50),
    (Heartbeat(10, 0, 193, 3, 4), 25),
    (JuniorWheels(4711, 12, (0.5, -0.35), 0.25, 1, 1), 10),
    (JuniorManeuver(4711, 13, 0.25, 5, 1, 1, 4, (1, 1, 3, 4, 0, 0, 0, 0)), 4),
    (
        JuniorManeuverResult(
            4711, 13, EIGHT, EIGHT, EIGHT, (0.12,) * 8, (0.0,) * 8, (None,) * 8, (1,) * 8, (0,) * 8, 255, 190, 0, 0, 4, 3, 7
        ),
        4,
    ),
    (RobotAck(47102, 4711, 13, 255, 190, 0, 0), 14),
    (RobotStatus(12.3, 40, 1000, 0, 0, 1, 7, 4711, 13, 3), 1),
    (ParamValue("WHEEL_SPEED", 400.0, 9, 24, 23), 2),
    (CommandLong(1, 1, 400, 0, 1.0), 1),
    (Timesync(0, 1_234_567_890), 1),
)
"""One second of a coaching run: messages and how many of each."""


class Discard:
    """A file that keeps nothing, for pymavlink to write to."""

    def write(self, data: bytes) -> int:
        """Take the bytes."""
        return len(data)


def generated_class() -> Any:  # noqa: ANN401 - a module made at run time
    """The module that mavgen makes of the dialect."""
    mavgen = importlib.import_module("pymavlink.generator.mavgen")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "junior_pymavlink.py"
        options = mavgen.Opts(str(path), wire_protocol="2.0", language="Python3")
        with contextlib.redirect_stdout(io.StringIO()):
            mavgen.mavgen(options, [str(ROOT / "firmware_protocol/dialect/junior.xml")])
        spec = importlib.util.spec_from_file_location("junior_pymavlink", path)
        if spec is None or spec.loader is None:
            raise RuntimeError("mavgen made no module")
        module = importlib.util.module_from_spec(spec)
        sys.modules["junior_pymavlink"] = module
        spec.loader.exec_module(module)
    return module


def pymavlink_end(theirs: Any, *, signed: bool) -> Any:  # noqa: ANN401 - of the generated module
    """An end of a link made of the generated class."""
    link = theirs.MAVLink(Discard(), srcSystem=1, srcComponent=1)
    link.robust_parsing = True
    if signed:
        link.signing.secret_key = KEY.secret
        link.signing.sign_outgoing = True
    return link


def rate(count: int, work: Callable[[], None]) -> float:
    """Messages per second of one run."""
    start = perf_counter()
    work()
    return count / (perf_counter() - start)


def compare(name: str, ours: Callable[[], None], other: Callable[[], None], count: int, rounds: int) -> float:
    """Measure two ways of doing the same, print, and return the ratio of their rates."""
    pairs = [(rate(count, ours), rate(count, other)) for _ in range(rounds)]
    ratio = median(a / b for a, b in pairs)
    print(
        f"{name}: ours {median(a for a, _ in pairs) / 1e3:6.1f} k/s, "
        f"pymavlink {median(b for _, b in pairs) / 1e3:6.1f} k/s, ratio {ratio:.2f}"
    )
    return ratio


def codec(*, signed: bool) -> MavlinkCodec:
    """An end of ours; one that signs has a clock that stands still."""
    if signed:
        return SignedMavlinkCodec(system=1, component=1, signing=Signing(KEY, lambda: 0))
    return MavlinkCodec(system=1, component=1)


def works(theirs: Any, *, signed: bool) -> Iterator[tuple[str, Callable[[], None], Callable[[], None], int]]:  # noqa: ANN401
    """What is to be done, our way and theirs, and how many frames it is.

    Args:
        theirs: The generated module.
        signed: Every frame is signed, and checked.

    Yields:
        For each direction its name, ours, theirs, and the number of frames.
    """
    messages = [message for message, count in TRAFFIC for _ in range(count)] * 20
    sender = codec(signed=signed)
    frames = [sender.encode(message) for message in messages]
    reader = pymavlink_end(theirs, signed=signed)
    foreign = [reader.parse_buffer(frame)[0] for frame in frames]

    def encode() -> None:
        ours = codec(signed=signed).encode
        for message in messages:
            ours(message)

    def encode_theirs() -> None:
        link = pymavlink_end(theirs, signed=signed)
        for message in foreign:
            link.send(message)

    def decode() -> None:
        ours = codec(signed=signed).receive
        for frame in frames:
            ours(frame, 0.0)

    def decode_theirs() -> None:
        link = pymavlink_end(theirs, signed=signed)
        for frame in frames:
            link.parse_buffer(frame)

    suffix = " signed" if signed else ""
    yield f"encode{suffix}", encode, encode_theirs, len(frames)
    yield f"decode{suffix}", decode, decode_theirs, len(frames)


def main(arguments: list[str] | None = None) -> int:
    """Measure and print.

    Args:
        arguments: Command line without the program's name.

    Returns:
        Exit status: 1 if ours is slower in any line.
    """
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=15, help="interleaved runs (default %(default)s)")
    rounds = parser.parse_args(arguments).rounds
    theirs = generated_class()
    ratios = [compare(*work, rounds) for signed in (False, True) for work in works(theirs, signed=signed)]
    return 1 if min(ratios) < 1 else 0


if __name__ == "__main__":
    sys.exit(main())
