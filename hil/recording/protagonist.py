"""Of several robots in one log, the one that pictures are about."""

from __future__ import annotations


class Protagonist:
    """The robot that a session was opened with first; until then, the one that was heard first.

    Attributes:
        system: Its system id; None while nobody was heard.
    """

    def __init__(self) -> None:
        self.system: int | None = None
        self._chosen = False

    def taken(self, system: int) -> None:
        """A session is being opened with a robot.

        Args:
            system: Its system id.
        """
        if not self._chosen:
            self._chosen = True
            self.system = system

    def heard(self, system: int) -> bool:
        """Something came from a robot.

        Args:
            system: Its system id.

        Returns:
            It is the one.
        """
        if self.system is None:
            self.system = system
        return system == self.system
