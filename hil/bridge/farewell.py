"""What was said at the other end of a link just before it ended: why, as like as not."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import LinkClosedError, bare_text
from firmware_protocol.messages import SEVERITY_ERROR

if TYPE_CHECKING:
    from firmware_protocol.errors import LinkError
    from firmware_protocol.messages import Statustext

_LAST_WORDS: Final = 1.0
"""An error that was told so shortly before the end of a link is taken for its reason, in s."""


class Farewell:
    """The last error that was told to people.

    Attributes:
        said: What was said when the link ended last; empty where nothing was.
    """

    def __init__(self) -> None:
        self.said = ""
        self._complaint: tuple[float, str] | None = None

    def heard(self, message: Statustext, time: float) -> None:
        """Something was told to people.

        Args:
            message: What.
            time: When, in s.
        """
        if message.severity <= SEVERITY_ERROR:
            self._complaint = (time, message.text)

    def explained(self, error: LinkError, now: float) -> LinkError:
        """Why a link has ended, with what was said just before.

        Args:
            error: How it ended.
            now: Time in s.
        """
        complaint, self._complaint = self._complaint, None
        if complaint is None or now - complaint[0] > _LAST_WORDS:
            return error
        self.said = complaint[1]
        return LinkClosedError(error.url, f"{bare_text(error)}; it said: {self.said}")
