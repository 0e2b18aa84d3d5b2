"""What a run asks of who looks on, and the answers that are taken: only such as it asks for, and each once."""

from __future__ import annotations

import json
from functools import partial
from threading import Lock
from typing import TYPE_CHECKING, Any, Final

from hil.bridge.operator import CHOICES
from hil.questions import ASKED

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from hil.look.live.overhearing import Overheard

POWER_OFF, POWER_ON, LIFT, PUT_DOWN = "power-off", "power-on", "lift", "put-down"
"""What somebody may do to emulated robots that are served."""
OF_ROBOT_SIDE: Final = frozenset((POWER_OFF, POWER_ON, LIFT, PUT_DOWN))


class Choices:
    """Hears what is asked for, and passes answers on.

    Args:
        ask: Passes one on to who controls.
        tell: Is told, as JSON, what is asked for now.
        known: What may be asked for at all.
    """

    def __init__(self, ask: Callable[[str], None], tell: Callable[[str], None], known: frozenset[str] = CHOICES) -> None:
        self._known = known
        self._ask = ask
        self._tell = tell
        self._open: frozenset[str] = frozenset()
        self._lock = Lock()

    @property
    def inputs(self) -> dict[str, Callable[[], dict[str, Any]]]:
        """What may be asked for on the page, by name."""
        return {choice: partial(self.choose, choice) for choice in sorted(self._known)}

    def choose(self, choice: str) -> dict[str, Any]:
        """Answer.

        Args:
            choice: What.

        Returns:
            `taken`: it was asked for, and nobody has answered before.
        """
        with self._lock:
            taken = choice in self._open
            if taken:
                self._open = frozenset()
                self._ask(choice)
        return {"taken": taken}

    def hear(self, overheard: Iterable[Overheard]) -> None:
        """Take what the run asks for.

        Args:
            overheard: Entries, in order.
        """
        for one in overheard:
            if one.topic != "/events" or ASKED.encode() not in one.data:
                continue
            event = one.entry().value
            if event.kind != ASKED:
                continue
            choices = [choice for choice in json.loads(event.fields).get("choices", ()) if choice in self._known]
            with self._lock:
                self._open = frozenset(choices)
            self._tell(json.dumps({"text": event.text, "choices": choices}))
