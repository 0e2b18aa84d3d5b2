"""What a terminal sends for keys, in pieces of any size: nothing of a sequence is taken for a key of its own."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.terminal.key_codes import KeyDecoder


@pytest.mark.parametrize(
    ("sent", "keys"),
    [
        (b"ad q", ["a", "d", " ", "q"]),
        (b"\x1b[A\x1b[B\x1b[C\x1b[D", ["^", "v", ">", "<"]),
        (b"\x1bOA\x1bOD", ["^", "<"]),
        (b"\x1b[1;5A\x1b[1;2D", ["^", "<"]),
        (b"\x1b[5~\x1b[6~\x1b[H\x1b[F\x1b[1~\x1b[4~", ["pageup", "pagedown", "home", "end", "home", "end"]),
        (b"\x1b[3~\x1b[200~\x1b[I\x1bOP", []),
        (b"\x1b[a\x1b[b", []),
        (b"\x1b", []),
        (b"\x1be", ["e"]),
        (b"\x1b\x1b[A", ["^"]),
        ("ä?\t".encode(), ["ä", "?", "\t"]),
        (b"\xff\xfea", ["a"]),
    ],
)
def test_what_is_sent_is_a_key_or_nothing(sent: bytes, keys: list[str]) -> None:
    assert KeyDecoder().feed(sent) == keys
    decoder = KeyDecoder()
    assert [key for byte in sent for key in decoder.feed(bytes([byte]))] == keys


@pytest.mark.parametrize("begun", [b"\x1b", b"\x1b[", b"\x1bO", b"\x1b[1;"])
@pytest.mark.parametrize("stop", [b"e", b" ", b"E"])
def test_a_key_that_stops_is_never_the_end_of_something_else(begun: bytes, stop: bytes) -> None:
    decoder = KeyDecoder()
    assert decoder.feed(begun) == []
    assert decoder.feed(stop) == [stop.decode()]


@given(st.lists(st.binary(max_size=8), max_size=20))
def test_nothing_that_is_sent_is_too_much(pieces: list[bytes]) -> None:
    decoder = KeyDecoder()
    for piece in pieces:
        assert all(key for key in decoder.feed(piece))
    assert decoder.feed(b" ")[-1:] == [" "]
