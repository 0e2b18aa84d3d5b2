"""What an operator has asked for, in words: keys, and other inputs of the bridge, as reports and pages tell of them."""

from __future__ import annotations

from typing import Final

from hil.bridge.operator import (
    CONTINUE,
    DRAWN,
    GUEST_STOP,
    INTERRUPT,
    INTERRUPTED,
    LOST,
    PARAMETERS,
    PAUSE,
    READY,
    RESUME,
    STOP,
    SUSPEND,
    WON,
)
from hil.questions import BY_KEY, key_name

INPUTS: Final = {
    INTERRUPT: "the run was interrupted (Ctrl-C or a signal)",
    INTERRUPTED: "the program was interrupted, and ended",
    SUSPEND: "the program was suspended (Ctrl-Z)",
    CONTINUE: "the program went on",
    STOP: "stop, asked for on the live page",
    WON: "won, said on the live page",
    LOST: "lost, said on the live page",
    DRAWN: "drawn, said on the live page",
    READY: "ready, said on the live page",
    PAUSE: "pause, asked for on the live page",
    RESUME: "go on, asked for on the live page",
    GUEST_STOP: "stop, asked for by a program that looks on at the shared link",
    PARAMETERS: "parameters, asked for by a program that looks on at the shared link",
}
"""Inputs that are no keys."""
KEYS: Final = {
    " ": "space, stop", "e": "e, emergency stop", "E": "E, emergency stop of all", "a": "a, arm", "d": "d, disarm",
    "q": "q, quit", "^": "drive forward", "v": "drive backward", "<": "turn left", ">": "turn right", "n": "n, next robot",
    "p": "p, robot before",
}  # fmt: skip
_ANSWERS: Final = {key: f"{key_name(key)}, {choice}" for key, choice in BY_KEY.items()}


def key_words(key: str, *, questioned: bool) -> str:
    """What a key asked for, in words.

    Args:
        key: The key.
        questioned: The run asks questions, and takes keys as answers.
    """
    return (_ANSWERS if questioned else KEYS).get(key, key_name(key)[:20])
