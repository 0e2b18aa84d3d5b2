"""Damages good files in many ways, the same ones for the same seed."""

from __future__ import annotations

import copy
import json
import struct
import zlib
from typing import TYPE_CHECKING, Any, Final

import tomli_w
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Chunk, DataEnd, Footer, Header

from hil.mcaplog import LogReader
from hil.mcaplog.writing.writer import MAGIC

if TYPE_CHECKING:
    import random
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from mcap.records import McapRecord

BIG: Final = "@a number of 5,000 digits@"
DEEP: Final = "@a list in a list in a list@"
VALUES: Final[tuple[Any, ...]] = (
    float("nan"), float("inf"), -float("inf"), -5, -1, 0, 1, 7, 15, 16, 99, 255, 256, 900, 2**31, 2**63, 2**64, 2**127,
    -(2**70), 0.5, -0.5, 1e300, -1e300, 1e12, BIG, "", "x", "none", "unknown", "nobody",
    "[bold]$x^$", "\x1b[2J", "a" * 20_000, "é\u2028",
    [], {}, [[]], [1, 2, 3], [-7, 900], [99] * 4, {"a": 1}, True, False,
)  # fmt: skip
"""What is put in the place of a field."""
JUNK: Final = (
    b"\x00",
    b"\xff",
    b"[",
    b"{",
    b'"',
    b"'''",
    b'"""',
    b"a.b.c.",
    b"\n",
    b"\\",
    b"=",
    b"nan",
    b"1e999",
    b"0x",
    b"]]",
)


def damaged_bytes(good: bytes, rng: random.Random) -> bytes:
    """A file with bytes flipped, cut, moved, repeated or put in."""
    data = bytearray(good)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        at = rng.randrange(len(data) + 1)
        length = rng.choice((1, 2, 8, 64, 1000))
        match rng.randrange(7):
            case 0 if data:
                data[at % len(data)] ^= 1 << rng.randrange(8)
            case 1:
                del data[at:]
            case 2:
                del data[at : at + length]
            case 3:
                start = rng.randrange(len(data) + 1)
                data[at:at] = data[start : start + length]
            case 4:
                data[at:at] = data[at : at + length] * rng.choice((2, 10, 100))
            case 5:
                data[at:at] = rng.choice(JUNK) * rng.choice((1, 3, 100, 3000))
            case _:
                data[at:at] = bytes(length * 20)
    return bytes(data)


def damaged_text(good: bytes, rng: random.Random) -> bytes:
    """A text as another editor might have saved it, or damaged as bytes are."""
    text = good.decode()
    match rng.randrange(8):
        case 0:
            return text.encode(rng.choice(("utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-8-sig")))
        case 1:
            return text.replace("\n", rng.choice(("\r\n", "\r", "\u2028"))).encode()
        case 2:
            lines = text.splitlines(keepends=True)
            rng.shuffle(lines)
            return "".join(lines).encode()
        case _:
            return damaged_bytes(good, rng)


def damaged_values(data: Any, rng: random.Random) -> Any:  # noqa: ANN401 - plain values
    """Plain values with some replaced, taken out, renamed or added."""
    data = copy.deepcopy(data)
    for _ in range(rng.choice((1, 1, 1, 2, 5))):
        places = list(_places(data))
        if not places:
            return data
        holder, key = rng.choice(places)
        match rng.randrange(8):
            case 0:
                del holder[key]
            case 1 if isinstance(holder, dict):
                holder[rng.choice(("x", "é", "", "a" * 300, "nan", str(key) + "s"))] = holder.pop(key)
            case 2 if isinstance(holder, list):
                holder[key:key] = [copy.deepcopy(holder[key])] * rng.choice((1, 2, 300))
            case 3:
                holder[key] = DEEP
            case _:
                holder[key] = copy.deepcopy(rng.choice(VALUES))
    return data


def _places(data: Any) -> list[tuple[Any, Any]]:  # noqa: ANN401 - plain values
    found: list[tuple[Any, Any]] = []
    waiting = [data]
    while waiting:
        holder = waiting.pop()
        if isinstance(holder, dict | list):
            for key, value in list(holder.items()) if isinstance(holder, dict) else list(enumerate(holder)):
                found.append((holder, key))
                waiting.append(value)
    return found


def as_json(data: Any) -> bytes:  # noqa: ANN401 - plain values
    """As a JSON file."""
    return _monstrous(json.dumps(data, indent=1))


def as_toml(data: Any) -> bytes:  # noqa: ANN401 - plain values
    """As a TOML file."""
    table = data if isinstance(data, dict) else {"x": data}
    return _monstrous(tomli_w.dumps(table))


def _monstrous(text: str) -> bytes:
    """A file with what no writer writes in the place of what stands for it."""
    return text.replace(f'"{BIG}"', "9" * 5000).replace(f'"{DEEP}"', "[" * 3000 + "]" * 3000).encode()


def damaged_document(good: Any, write: Callable[[Any], bytes], rng: random.Random) -> bytes:  # noqa: ANN401 - plain values
    """A file of TOML or JSON, damaged in its values or in its text."""
    return write(damaged_values(good, rng)) if rng.random() < 0.7 else damaged_text(write(good), rng)


# --- logs ----------------------------------------------------------------------------------------------------------------


def records_of(log: Path) -> list[tuple[int, bytes]]:
    """Schemas, channels and entries of a log, in order."""
    wanted = {Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.METADATA}
    seen: set[bytes] = set()
    found = []
    for record in LogReader(log).records():
        if record.opcode not in wanted or (record.opcode != Opcode.MESSAGE and record.content in seen):
            continue
        seen.add(record.content)
        found.append((int(record.opcode), record.content))
    return found


def packed(records: Sequence[tuple[int, bytes]]) -> bytes:
    """Records as they stand in a chunk."""
    return b"".join(struct.pack("<BQ", opcode, len(content)) + content for opcode, content in records)


def log_of(chunks: Sequence[bytes], *, compressed: bool = True, outside: Sequence[tuple[int, bytes]] = ()) -> bytes:
    """A whole log of some chunks, each as its records stand in it."""
    parts = [MAGIC, _written(Header(profile="", library="damaged")), packed(outside)]
    for data in chunks:
        kept = zstandard.ZstdCompressor().compress(data) if compressed else data
        parts.append(_written(Chunk("zstd" if compressed else "", kept, 0, 0, zlib.crc32(data), len(data))))
    parts += [_written(DataEnd(0)), _written(Footer(0, 0, 0)), MAGIC]
    return b"".join(parts)


def _written(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


def damaged_log(good: bytes, records: Sequence[tuple[int, bytes]], rng: random.Random) -> bytes:
    """A log damaged as a file, or in what its records hold."""
    if rng.random() < 0.4:
        return damaged_bytes(good, rng)
    changed = list(records)
    for _ in range(rng.choice((1, 3, 30))):
        at = rng.randrange(len(changed))
        opcode, content = changed[at]
        match rng.randrange(6):
            case 0:
                del changed[at]
            case 1:
                changed[at:at] = changed[at : at + 3] * rng.choice((1, 50))
            case 2:
                changed[at] = rng.randrange(256), content
            case 3:
                changed[at] = opcode, content[:22] + struct.pack("<d", rng.choice((float("nan"), 1e308, -1.0))) * 8
            case _:
                changed[at] = opcode, damaged_bytes(content, rng)
    data = packed(changed)
    if rng.random() < 0.2:
        data = damaged_bytes(data, rng)
    return log_of([data], compressed=rng.random() < 0.8)
