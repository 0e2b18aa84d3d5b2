"""From the bytes that a terminal sends for keys to the keys. No I/O."""

from __future__ import annotations

import re
from codecs import getincrementaldecoder
from typing import Final

ARROWS: Final = {"A": "^", "B": "v", "C": ">", "D": "<"}
"""What an arrow is called here, by the letter that ends its sequence."""
_NAMED: Final = {
    "5~": "pageup", "6~": "pagedown", "H": "home", "F": "end", "1~": "home", "4~": "end", "7~": "home", "8~": "end",
}  # fmt: skip
_SEQUENCE: Final = re.compile(r"\x1b(?:\[([0-?]*)[ -/]*([@-~])|O()([@-~]))")
_BEGUN: Final = re.compile(r"\x1b(?:\[[0-?]*[ -/]*|O)?\Z")
_STOPS: Final = "eE "


class KeyDecoder:
    """Takes what a terminal sends, in pieces of any size.

    A sequence that is not known is swallowed whole, since its letters would be taken for keys. One that is begun and not ended
    waits for the next piece; but a key that stops is never taken for its end.
    """

    def __init__(self) -> None:
        self._decoder = getincrementaldecoder("utf-8")("ignore")
        self._begun = ""

    def feed(self, data: bytes) -> list[str]:
        """Take a piece.

        Args:
            data: Bytes from the terminal.

        Returns:
            The keys: one character each, an arrow as in `ARROWS`; those of more letters by name, as `pageup`.
        """
        text = self._decoder.decode(data)
        if text and text[0] not in _STOPS:
            text = self._begun + text
        self._begun = ""
        keys: list[str] = []
        at = 0
        while at < len(text):
            if text[at] != "\x1b":
                keys.append(text[at])
                at += 1
            elif (found := _SEQUENCE.match(text, at)) is not None:
                keys += _key(found[1] or found[3] or "", found[2] or found[4])
                at = found.end()
            elif _BEGUN.match(text, at):
                self._begun = text[at:]
                break
            else:  # Escape, or Alt with the key that follows
                at += 1
        return keys


def _key(parameters: str, final: str) -> list[str]:
    """The key of a sequence; none where it is not known. With Shift, Alt or Ctrl an arrow is the same arrow."""
    first, _, modifiers = parameters.partition(";")
    if modifiers and final in ARROWS | {"H": "", "F": ""} and first == "1":
        first = ""
    name = _NAMED.get(first + final, ARROWS.get(final, "") if not first else "")
    return [name] if name else []
