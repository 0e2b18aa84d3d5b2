"""A serial CAN adapter without hardware: the ASCII protocol of Lawicel's CAN232, which the drivers call slcan.

Text in, frames and answers out; frames in, text out. Frames are in the serial form of `firmware_protocol.wire.can.frame`.
Source: "CAN232 Manual", Lawicel AB (http://www.can232.com/docs/can232_v3.pdf).
"""

from __future__ import annotations

from typing import Final

from firmware_protocol.wire.can.frame import CanFrame, split_records

OK: Final = b"\r"
ERROR: Final = b"\a"
_ANSWERS: Final = dict.fromkeys((b"", b"O", b"L", b"C", b"S", b"s", b"Y", b"Z", b"M", b"m"), OK) | {
    b"V": b"V1013" + OK,
    b"N": b"NA123" + OK,
    b"F": b"F00" + OK,
}
"""What is said to a command: done, or its version, serial number, error flags."""
_LONGEST: Final = 64
"""Longest command; a line without an end is forgotten."""


class SlcanAdapter:
    """The adapter's own program.

    Attributes:
        is_open: The channel is open: frames pass.
    """

    def __init__(self) -> None:
        self.is_open = False
        self._line = b""

    def take(self, text: bytes) -> tuple[bytes, bytes]:
        """Take what the computer has sent.

        Args:
            text: Any piece of it.

        Returns:
            Frames for the bus, in serial form, and the answers to the computer.
        """
        frames: list[bytes] = []

        *lines, rest = (self._line + text).split(b"\r")
        self._line = rest if len(rest) <= _LONGEST else b""
        answers = [self._command(line.lstrip(b"\n"), frames) for line in lines]
        return b"".join(frames), b"".join(answers)

    def give(self, frames: bytes) -> bytes:
        """What the computer is told of frames on the bus.

        Args:
            frames: Frames in serial form.

        Returns:
            Text; nothing while the channel is closed.
        """
        return b"".join(map(self._text, split_records(frames))) if self.is_open else b""

    @staticmethod
    def _text(record: bytes) -> bytes:
        frame = CanFrame.unpack(record)
        head = f"T{frame.identifier:08X}" if frame.extended else f"t{frame.identifier:03X}"
        return f"{head}{frame.length}{frame.data.hex().upper()}\r".encode()

    def _command(self, line: bytes, frames: list[bytes]) -> bytes:
        """Carry out one command."""
        letter = line[:1]
        if letter in {b"t", b"T"}:
            return self._transmit(line, frames)
        if letter in {b"O", b"L", b"C"}:
            self.is_open = letter != b"C"
        return _ANSWERS.get(letter, ERROR)

    def _transmit(self, line: bytes, frames: list[bytes]) -> bytes:
        extended = line[:1] == b"T"
        digits = 8 if extended else 3
        try:
            text = line[1:].decode("ascii")
            if not text.isalnum():  # signs and spaces, which Python takes for a part of numbers
                return ERROR
            frame = CanFrame(int(text[:digits], 16), bytes.fromhex(text[digits + 1 :]), extended)
            good = int(text[digits], 16) == frame.length and len(text) == digits + 1 + 2 * frame.length
        except (ValueError, IndexError):
            return ERROR
        if not good or not self.is_open:
            return ERROR
        frames.append(frame.pack())
        return (b"Z" if extended else b"z") + OK
