"""Opens chunks, whatever they are compressed with, up to a limit; where that is asked for, up to the damage in one."""

from __future__ import annotations

import zlib
from contextlib import suppress
from io import BytesIO
from struct import Struct
from struct import error as struct_error
from typing import TYPE_CHECKING, Final

import zstandard
from google.protobuf.message import DecodeError
from lz4.frame import LZ4FrameDecompressor
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.records import Chunk

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

RECORD_HEAD: Final = Struct("<BQ")
"""Opcode and length of a record."""
DAMAGE: Final = (
    McapError, struct_error, AttributeError, ValueError, TypeError, LookupError, OverflowError, MemoryError, RecursionError,
    RuntimeError, EOFError, zstandard.ZstdError, DecodeError,
)  # fmt: skip
"""What is raised on the way from bytes to values where the bytes are damaged."""
_PIECE: Final = 1024
"""What is unpacked at once of a damaged chunk, in bytes: less than this is lost before the damage."""


def stream(content: bytes) -> ReadDataStream:
    """What the records of the `mcap` package are read from."""
    return ReadDataStream(BytesIO(content))


def read_chunk(content: bytes) -> tuple[Chunk, int]:
    """Read a chunk record, and what it will unpack to, in bytes, as it says itself.

    Args:
        content: Content of the record.

    Raises:
        ValueError: It is compressed in a way that nobody has told this program of. Likewise one of `DAMAGE`.
    """
    chunk = Chunk.read(stream(content))
    if not chunk.compression:
        return chunk, len(chunk.data)
    if chunk.compression not in {"zstd", "lz4"}:
        raise ValueError(f"compressed by {chunk.compression[:20]!r}")
    size = zstandard.frame_content_size(chunk.data) if chunk.compression == "zstd" else -1
    return chunk, int(size) if size >= 0 else chunk.uncompressed_size  # streaming compressors leave it to the record


def unpack(chunk: Chunk, size: int) -> bytes:
    """The records of a chunk.

    Args:
        chunk: The chunk.
        size: What it unpacks to, in bytes; more is not unpacked.

    Raises:
        ValueError: It unpacks to something else, or its checksum is wrong. Likewise one of `DAMAGE`.
    """
    if not chunk.compression:
        data = chunk.data
    elif chunk.compression == "zstd" and zstandard.frame_content_size(chunk.data) == size:
        data = zstandard.ZstdDecompressor().decompress(chunk.data)  # at once, which is faster
    else:
        data = _unpacker(chunk)(size + 1)
    if len(data) != size:
        raise ValueError(f"unpacks to {'more' if len(data) > size else 'less'} than it says")
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise ValueError("bad checksum")
    return data


def salvage(content: bytes, most: int) -> bytes:
    """What unpacks of a chunk that is cut off or does not unpack to its end.

    Nothing of one that does unpack, to something of another checksum: which of its bytes are wrong cannot be told.

    Args:
        content: Content of the record, as far as there is any.
        most: Bytes to unpack at most.
    """
    out = bytearray()
    with suppress(*DAMAGE):
        chunk = Chunk.read(stream(content))
        if not chunk.compression:
            return chunk.data[:most] if len(chunk.data) < chunk.uncompressed_size else b""
        read = _unpacker(chunk)
        while len(out) < most:
            piece = read(min(_PIECE, most - len(out)))
            if not piece:
                return bytes(out) if len(out) < chunk.uncompressed_size else b""
            out += piece
    return bytes(out)


def _unpacker(chunk: Chunk) -> Callable[[int], bytes]:
    """What gives the next so many bytes of a chunk, fewer only where there are no more."""
    if chunk.compression == "zstd":
        return zstandard.ZstdDecompressor().stream_reader(chunk.data, read_across_frames=True).read
    if chunk.compression != "lz4":
        raise ValueError(f"compressed by {chunk.compression[:20]!r}")
    unpacker, waiting = LZ4FrameDecompressor(), chunk.data

    def read(size: int) -> bytes:
        nonlocal waiting
        out = bytearray()
        while len(out) < size and not unpacker.eof:
            piece = unpacker.decompress(waiting, size - len(out))
            waiting = b""
            if not piece and unpacker.needs_input:
                break
            out += piece
        return bytes(out)

    return read


def split(data: bytes, note: Callable[[str], None]) -> Iterator[tuple[int, int, int]]:
    """The records of a chunk, each whole.

    Args:
        data: What the chunk unpacks to.
        note: Is told, in words, where there is no next record before the end.

    Yields:
        Opcode, and where the content begins and ends.
    """
    at, end, head = 0, len(data), RECORD_HEAD.size
    read = RECORD_HEAD.unpack_from
    while at + head <= end:
        opcode, length = read(data, at)
        at += head
        if not opcode:
            note("holds what is no record")
            return
        if at + length > end:
            note("ends within a record")
            return
        yield opcode, at, at + length
        at += length
