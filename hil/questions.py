"""What a run asks of a person, and the answers: by keys of the terminal, or by buttons of the live page.

A question is an event of the log, which the live page shows as buttons; its answer is an operator's input of the bridge. So
a log tells both, and a replay is answered as the run was.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from hil.bridge.operator import DRAWN, KEY, LOST, PAUSE, READY, RESUME, WON

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hil.bridge.operator import Operator
    from hil.recording.recorder import Recorder

ASKED: Final = "asked"
"""Kind of the event that says what is asked for now; its field `choices` lists what may be answered."""
KEYS: Final = {WON: "w", LOST: "l", DRAWN: "d", READY: "\n", PAUSE: "p", RESUME: "r"}
"""The key of each choice."""
BY_KEY: Final = {key: choice for choice, key in KEYS.items()} | {"\r": READY}
"""The choice of each key."""
_ENTER: Final = {"\n", "\r"}


def key_name(key: str) -> str:
    """What a key of the terminal is called.

    Args:
        key: What it types.
    """
    return "Enter" if key in _ENTER else key


class Questions:
    """Asks, and takes what is answered; one question at a time.

    Args:
        operator: Takes in the answers.
        recorder: Writes the log, of which the live page is told; None where there is none.
        say: Says to a person at the terminal what is asked for; None: nobody is there.

    Attributes:
        open: What may be answered now.
    """

    def __init__(self, operator: Operator, recorder: Recorder | None, say: Callable[[str], None] | None) -> None:
        self.open: tuple[str, ...] = ()
        self._operator = operator
        self._recorder = recorder
        self._say = say

    def ask(self, text: str, choices: Sequence[str]) -> None:
        """Ask; what was answered before is no answer to this.

        Args:
            text: What, in words.
            choices: What may be answered, of `hil.bridge.operator.CHOICES`; none: nothing is asked for any more.
        """
        self._answers()
        self.open = tuple(choices)
        if self._recorder is not None:
            self._recorder.note(ASKED, text, choices=list(choices))
        if self._say is not None and choices:
            keys = ", ".join(f"{key_name(KEYS[choice])}: {choice}" for choice in choices)
            self._say(f"{text} ({keys})")

    def answer(self) -> str:
        """What was answered, of what may be; empty: nothing yet. A question is answered once."""
        found = next((choice for choice in self._answers() if choice in self.open), "")
        if found:
            self.open = ()
        return found

    def _answers(self) -> list[str]:
        """What steps have taken in since this was last called: keys first."""
        keys = [one.what.removeprefix(KEY) for one in self._operator.pressed()] if self._say is not None else []
        return [*(BY_KEY[key] for key in keys if key in BY_KEY), *self._operator.chosen()]
