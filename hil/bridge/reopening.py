"""When a link that is gone is opened again, and when that is given up."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Protocol

from firmware_protocol.errors import LinkClosedError, LinkError, LinkOpenError, bare_text

if TYPE_CHECKING:
    from firmware_protocol.link import Link

FIRST: Final = 0.1
"""Time from a loss to the first try, in s."""
FACTOR: Final = 1.5
"""Every further wait is this much longer."""
LONGEST: Final = 0.5
"""But never longer than this, in s."""
STEADY: Final = 5.0
"""A link that has held for this long has not just flickered: the next loss gets all the patience again. In s."""
_SLACK: Final = 1e-6
"""Less than anything that matters, more than the rounding of sums of control periods, in s."""


class Opener(Protocol):
    """Opens one address, again and again: the same robot, if need be under another name."""

    def open(self) -> Link:
        """Open the link.

        Raises:
            LinkOpenError: Not yet.
        """
        ...

    def let_pass(self, duration: float) -> None:
        """Let time pass while there is no link; asked only of links in lock-step.

        Args:
            duration: In s, rounded up to whole control periods.
        """
        ...


class Reopening:
    """The tries to open a link that is gone: when the next one is due, and when the patience is over. Does no waiting.

    Args:
        opener: Opens the link.
        patience: Time after which a link that has not been opened, or brought no robot, is given up, in s.

    Attributes:
        patience: Likewise.
        due: When the next try is due, in s.
    """

    def __init__(self, opener: Opener, patience: float) -> None:
        self.opener = opener
        self.patience = patience
        self.due = 0.0
        self._error = LinkError("", "")
        self._why = ""
        self._deadline = float("-inf")
        self._interval = FIRST
        self._opened = float("-inf")
        self._settled = True

    def begin(self, error: LinkError, now: float, *, refused: bool = False) -> None:
        """The link is gone.

        Args:
            error: Why.
            now: Time in s.
            refused: What answered there was not the robot: the patience runs on.
        """
        self._error = error
        if self._settled or (not refused and now - self._opened >= STEADY):
            self._deadline = now + self.patience
            self._interval = FIRST
            self._why = ""
        self._settled = False
        self.due = now + self._interval

    def wait(self, now: float) -> float:
        """Time to the next try, in s; 0 when it is due.

        Args:
            now: Time in s.
        """
        rest = self.due - now
        return rest if rest > _SLACK else 0.0

    def attempt(self, now: float) -> Link | None:
        """Try once.

        Args:
            now: Time in s.

        Returns:
            The open link; None for not yet: try again when `due` has come.

        Raises:
            LinkClosedError: The patience is over.
        """
        try:
            if now > self._deadline + _SLACK:
                raise self._over()
            link = self.opener.open()
        except LinkOpenError as error:
            self._why = f" ({bare_text(error)})"
            if now >= self._deadline - _SLACK:
                raise self._over() from error
            self._interval = min(self._interval * FACTOR, LONGEST)
            self.due = min(now + self._interval, self._deadline)
            return None
        self._opened = now
        return link

    def _over(self) -> LinkClosedError:
        return LinkClosedError(
            self._error.url, f"{bare_text(self._error)}; it did not come back within {self.patience:g} s{self._why}"
        )

    def settle(self) -> None:
        """The robot answers: the next loss is one of its own."""
        self._settled = True


class Outage:
    """A link that is gone, or back without a robot that can be used: since when, why, and what is told of it.

    Args:
        url: Address of the link.

    Attributes:
        lasts: There is an outage.
    """

    def __init__(self, url: str) -> None:
        self.lasts = False
        self._url = url
        self._told = ""
        self._since = 0.0
        self._cause = ""

    def lost(self, error: LinkError, now: float) -> bool:
        """The link is gone, perhaps once more.

        Args:
            error: Why.
            now: Time in s.

        Returns:
            That is to be told: it is not as before.
        """
        if not self.lasts:
            self._since = now
        news = not self.lasts or str(error) != self._cause
        self.lasts, self._cause = True, str(error)
        return news

    def back(self, url: str, now: float) -> str:
        """The link is there again, perhaps under another name.

        Args:
            url: Its address.
            now: Time in s.

        Returns:
            What is to be told of it; empty, if it was told.
        """
        name = "" if url == self._url else f", as {url}"
        text = "" if url == self._told else f"the link is back after {now - self._since:.1f} s{name}"
        self._told = self._url = url
        return text

    def over(self) -> None:
        """A robot can be used again."""
        self.lasts, self._told = False, ""
