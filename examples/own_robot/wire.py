"""Frames: bytes to messages and back, with nothing but what a MAVLink generator gives for junior.xml."""

from __future__ import annotations

import importlib.util
import os
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from pymavlink.generator import mavgen, mavparse  # type: ignore[import-untyped]

if TYPE_CHECKING:
    from collections.abc import Collection

Message = Any
"""A message that has come: its fields by name, and who sent it."""
COUNTERS = ("good", "bad_checksum", "unknown", "lost")


def load_dialect(xml: Path) -> Any:  # noqa: ANN401
    """Let pymavlink make a module of the dialect's definition."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "junior_dialect.py"
        options = mavgen.Opts(str(path), wire_protocol=mavparse.PROTOCOL_2_0, language="Python3", validate=False)
        written, sys.stdout = sys.stdout, open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115 - it is chatty
        try:
            mavgen.mavgen(options, [str(xml)])
        finally:
            sys.stdout.close()
            sys.stdout = written
        spec = importlib.util.spec_from_file_location("junior_dialect", path)
        assert spec
        assert spec.loader
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module


class Wire:
    """Bytes to messages and back; after damage it goes on with the byte behind the frame's start marker."""

    def __init__(self, dialect: Any, system: int, known: Collection[str]) -> None:  # noqa: ANN401
        self.dialect = dialect
        self.known = known
        self.mav = dialect.MAVLink(None, srcSystem=system, srcComponent=1)
        self.counters = dict.fromkeys(COUNTERS, 0)
        self.buffer = b""
        self.heard = 0.0
        self.expected: dict[tuple[int, int], int] = {}

    def encode(self, name: str, **fields: Any) -> bytes:  # noqa: ANN401
        """A message as a frame."""
        message = getattr(self.dialect, f"MAVLink_{name}_message")(**fields)
        data: bytes = message.pack(self.mav)
        self.mav.seq = (self.mav.seq + 1) % 256
        return data

    def receive(self, data: bytes, now: float) -> list[Message]:
        """All messages that are complete now."""
        messages: list[Message] = []
        if self.buffer and now - self.heard >= 0.02:  # a part of a frame, and then silence
            while self.buffer:
                self._skip()
                self._take(messages)
        if data:
            self.heard = now
            self.buffer += data
            self._take(messages)
        return messages

    def _skip(self) -> None:
        at = self.buffer.find(b"\xfd", 1)
        self.buffer = self.buffer[at:] if at > 0 else b""

    def _take(self, messages: list[Message]) -> None:
        while self.buffer:
            head = self.buffer
            if head[0] != 0xFD:
                self._skip()
                continue
            if len(head) < 3:
                return
            kind = self.dialect.mavlink_map.get(int.from_bytes(head[7:10], "little")) if len(head) >= 10 else None
            possible = 0 < head[1] <= 255 and not head[2] & ~1
            if possible and len(head) < 10:
                return
            if not possible or kind is None or head[1] > kind.unpacker.size or kind.msgname not in self.known:
                self._count(head, verified=False)
                self.counters["unknown"] += 1
                self._skip()
                continue
            total = 12 + head[1] + (13 if head[2] & 1 else 0)
            if len(head) < total:
                return
            crc = self.dialect.x25crc(head[1 : 10 + head[1]])
            crc.accumulate(bytes([kind.crc_extra]))
            if crc.crc != int.from_bytes(head[10 + head[1] : 12 + head[1]], "little"):
                self.counters["bad_checksum"] += 1
                self._skip()
                continue
            self.buffer = head[total:]
            self.counters["good"] += 1
            self._count(head, verified=True)
            messages.append(self._decode(head, kind))  # a signature is not looked at

    def _decode(self, frame: bytes, kind: Any) -> Message:  # noqa: ANN401
        """Payload to fields; zeros at its end may have been left out."""
        values = list(kind.unpacker.unpack(frame[10 : 10 + frame[1]].ljust(kind.unpacker.size, b"\0")))
        message = SimpleNamespace(name=kind.msgname.lower(), id=kind.id, sender=(frame[5], frame[6]))
        for name, length in zip(kind.ordered_fieldnames, kind.array_lengths, strict=True):
            if isinstance(values[0], bytes):  # characters come as one value
                value: Any = values.pop(0).partition(b"\0")[0].decode("latin1")
            else:
                value = values[:length] if length else values[0]
                del values[: length or 1]
            setattr(message, name, value)
        return message

    def _count(self, head: bytes, *, verified: bool) -> None:
        """Frames missing before this one; what was not verified is believed when it is the very next one."""
        if len(head) < 10:
            return
        sender, sequence = (head[5], head[6]), head[4]
        gap = (sequence - self.expected.get(sender, sequence)) % 256
        if not verified:
            if sender in self.expected and gap == 0:
                self.expected[sender] = (sequence + 1) % 256
        elif gap < 128:
            self.counters["lost"] += gap
            self.expected[sender] = (sequence + 1) % 256
