"""A link is shared: what the recorder is told of is copied out to guests, by a thread beside it."""

from __future__ import annotations

import asyncio
from collections import deque
from contextlib import suppress
from threading import Thread
from typing import TYPE_CHECKING, Final

from firmware_protocol.events import Received
from firmware_protocol.messages import Statustext
from firmware_protocol.wire.rows import messages_of
from hil.sharing.desk import FrontDesk
from hil.sharing.guests import HOST, SHARE, WARNING, Guests
from hil.sharing.known import ALWAYS

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.events import Rejected
    from firmware_protocol.wire.batch import Arrivals
    from firmware_protocol.wire.fields import Message
    from firmware_protocol.wire.rows import Rows

MOST_UNTOLD: Final = 50_000
"""Messages that wait to be copied out at most; the oldest are given up, and guests are told of it."""
TO_TAKE: Final = 1.0
"""Guests have so long to take the last that they are told, in s."""


class Sharing:
    """Shares what passes on a link.

    `received`, `arrived`, `sent` and `sent_rows` are called by the thread that records, as the recorder's are, and cost it
    next to nothing while nobody looks on.

    Args:
        host: Address of this machine to listen at.
        port: Port; 0: any that is free.
        driver: Name of the verb that drives.
        ask: Asks whoever drives for something, in whatever thread: see `FrontDesk`.

    Attributes:
        port: The port that is listened at.

    Raises:
        OSError: It can't be listened at.
    """

    def __init__(self, host: str, port: int, driver: str, ask: Callable[[str, str], None]) -> None:
        self._driver = driver
        self._desk = FrontDesk(ask)
        self._guests = Guests(self._desk, f"watching, {driver} drives")
        self._untold: deque[tuple[tuple[int, int], Message]] = deque(maxlen=MOST_UNTOLD)
        self._lost = 0
        self._called = self._closed = False
        self._loop = asyncio.new_event_loop()
        self._thread = Thread(target=self._run, name="guests of the link", daemon=True)
        try:
            self.port = self._loop.run_until_complete(self._guests.listen(host, port))
        except BaseException:
            self._loop.close()
            raise
        self._thread.start()

    def _run(self) -> None:
        self._loop.run_forever()
        self._loop.close()

    # --- what is told to the recorder --------------------------------------------------------------------------------

    def received(self, event: Received | Rejected) -> None:
        """See `Tap.received`."""
        if isinstance(event, Received):
            self._put((event.system, event.component), event.message)

    def arrived(self, came: Arrivals) -> None:
        """See `Tap.arrived`; what came as arrays is told to guests, if there are any, and else to nobody."""
        for event in came.objects() if len(self._guests) else came.events:
            self.received(event)

    def sent(self, time: float, message: Message) -> None:  # noqa: ARG002 - as the tap has it
        """See `Tap.sent`."""
        self._put(HOST, message)

    def sent_rows(self, time: float, message: type[Message], rows: Rows) -> None:
        """See `Tap.sent_rows`."""
        if len(self._guests):
            for one in messages_of(message, rows):
                self.sent(time, one)

    def _put(self, sender: tuple[int, int], message: Message) -> None:
        if not len(self._guests) and type(message) not in ALWAYS:
            return
        self._lost += len(self._untold) == MOST_UNTOLD
        self._untold.append((sender, message))
        if not self._called and not self._closed:
            self._called = True
            self._loop.call_soon_threadsafe(self._tell)

    # --- in the loop's thread ----------------------------------------------------------------------------------------

    def _tell(self) -> None:
        self._called = False
        for _ in range(len(self._untold)):
            sender, message = self._untold.popleft()
            self._guests.tell(sender, message)
            self._guests.give(self._desk.heard(message, *sender))
        if self._lost:
            lost, self._lost = self._lost, 0
            self._guests.tell(SHARE, Statustext(WARNING, f"{lost} messages are left out: this machine is busy"))

    # --- the end -----------------------------------------------------------------------------------------------------

    def finish(self, *, died: bool = False) -> None:
        """The run is over: tell everybody who looks on, and let them go. Repeating it does nothing.

        Args:
            died: Nobody has said so.
        """
        if self._closed:
            return
        self._closed = True
        text = f"{self._driver} {'has died, or was killed' if died else 'has ended'}: nobody drives"
        self._loop.call_soon_threadsafe(self._end, text)
        self._thread.join(2 * TO_TAKE)

    def _end(self, text: str) -> None:
        self._tell()
        self._guests.close(text)
        self._loop.create_task(self._leave())

    async def _leave(self) -> None:
        """Have the loop end once everybody has gone, or has had time to."""
        with suppress(TimeoutError):
            await asyncio.wait_for(self._guests.gone.wait(), TO_TAKE)
        self._guests.cut_off()
        await asyncio.sleep(0)
        self._loop.stop()
