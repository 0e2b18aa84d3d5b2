"""Shows a run that goes on: a thread beside the one that writes the log makes the parts, and a server hands them out.

Another one listens what robots say of the stop and what the run asks for, however long a part takes to be made.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
import threading
import time
from collections import deque
from itertools import zip_longest
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.messages import HOST_SYSTEM
from firmware_protocol.messages.robot import State
from hil.bridge.operator import CHOICES, STOP
from hil.look.live.broadcast import Broadcast
from hil.look.live.choices import OF_ROBOT_SIDE, Choices
from hil.look.live.overhearing import MOST_WAITING, OverhearingSink
from hil.look.live.server import LiveServer
from hil.look.live.unfolding import TOPICS, Unfolding
from hil.look.pages import live_page

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from hil.look.live.overhearing import Overheard
    from hil.look.live.unfolding import Episode
    from hil.mcaplog.reading.reader import LogEntry
    from hil.mcaplog.writing.sink import LogSink

REAL_TIME: Final = 0.1
"""What goes on is told so often, in s: where that costs little."""
LOCKSTEP: Final = 1.0
"""A new bout of a run in lock-step is told so often, in s: it lasts longer to watch."""
LISTENING: Final = 0.05
"""What has come is looked through so often, in s."""
NICENESS: Final = 10
"""Of the thread that makes parts. Not the least rank: who waits for the interpreter's lock waits for this one to have time."""
SWITCH: Final = 1e-3
"""For so long a thread keeps the interpreter's lock at most while another one wants it, in s."""
SHARE: Final = 4.0
"""Making a part costs so many times less than the time until the next one: who writes the log has the machine."""
CONFIRMED_WITHIN: Final = 1.0
"""How long robots have to say that they have stopped, in s."""
HEARD_LATELY: Final = 5.0
"""A robot that has said nothing for so long, in s of log time, is not there."""
TO_COME: Final = 5.0
"""A browser that is being started is waited for so long at the end, in s: the run may be over before it is there."""
TO_TAKE: Final = 3.0
"""Who looks on has so long to take the end, in s."""
DIED: Final = (
    "The program that this page shows has died, or was killed. This is its last state; whether robots are stopped is not known."
)
ENDED: Final = "The run is over."


class Showing:
    """A run's page, while it goes on.

    Args:
        sink: What takes the log's entries.
        run: The log's metadata record of what differs between two runs.
        ask: Is told what is asked for on the page, in whatever thread.
        lockstep: Time passes as fast as the machine can.
        public: Others on the network may look on.
        robot_side: It is emulated robots that are served: what may be asked for is done to them by hand, and nothing else.

    Attributes:
        sink: Where entries go now.
        url: Address of the page.

    Raises:
        OSError: No port can be listened on.
    """

    def __init__(
        self,
        sink: LogSink,
        run: Mapping[str, str],
        ask: Callable[[str], None],
        *,
        lockstep: bool,
        public: bool = False,
        robot_side: bool = False,
    ) -> None:
        self.sink = OverhearingSink(sink, TOPICS)
        self.sink.records["run"] = run
        self._lockstep = lockstep
        self._awaited = False
        self._unfolding = Unfolding()
        self._broadcast = Broadcast()
        self._stops = StopWatch(ask)
        self._leaving = threading.Event()
        self._heard: deque[Overheard] = deque(maxlen=MOST_WAITING)
        self._shown = -1
        self._series: str | None = None
        self._choices = Choices(ask, self._broadcast.ask, OF_ROBOT_SIDE if robot_side else CHOICES)
        inputs = self._choices.inputs if robot_side else {STOP: self._stops.stop, **self._choices.inputs}
        page = live_page(lockstep=lockstep, robot_side=robot_side)
        server = LiveServer(page, self._broadcast, inputs, public=public)
        self.url = server.url
        sys.setswitchinterval(SWITCH)
        self._listener = threading.Thread(target=self._listen, name="what is heard", daemon=True)
        self._thread = threading.Thread(target=self._run, name="what is shown", daemon=True)
        self._listener.start()
        self._thread.start()

    def await_browser(self) -> None:
        """A browser is being started that will look on: the end waits for it."""
        self._awaited = True

    def finish(self, *, died: bool = False) -> None:
        """The run is over: tell everybody who looks on.

        Args:
            died: Nobody has said so.
        """
        self._leaving.set()
        self._thread.join()
        self._broadcast.end(json.dumps(DIED if died else ENDED))
        if self._awaited:
            self._broadcast.wait_for_first(TO_COME)
        self._broadcast.wait_for_last(TO_TAKE)

    def _listen(self) -> None:
        leaving = False
        while not leaving:
            leaving = self._leaving.wait(LISTENING)
            heard = self.sink.take()
            self._stops.hear(heard)
            self._choices.hear(heard)
            self._heard.extend(heard)

    def _run(self) -> None:
        give_way()
        every = LOCKSTEP if self._lockstep else REAL_TIME
        over: list[Episode] = []
        due = 0.0
        while not self._leaving.wait(REAL_TIME):
            over += self._unfold()
            begun = time.monotonic()
            if begun >= due:
                self._tell(over, last=False)
                over = []
                done = time.monotonic()
                due = max(begun + every, done + SHARE * (done - begun))
        self._listener.join()
        self._tell(over + self._unfold(), last=True)

    def _unfold(self) -> list[Episode]:
        """Take what has come; the stretches that are over by it."""
        heard = self._heard
        return self._unfolding.hear([heard.popleft() for _ in range(len(heard))])

    def _tell(self, over: list[Episode], *, last: bool) -> None:
        """Tell of what is over, and how the rest stands; in lock-step, of what was over last, of each series of bouts."""
        unfolding, broadcast = self._unfolding, self._broadcast
        unfolding.about(dict(self.sink.records))
        for stretch in last_of_each_series(over) if self._lockstep else over:
            broadcast.commit(unfolding.part(stretch), instead=self._lockstep and stretch.series == self._series)
            self._series = stretch.series
        if unfolding.going is not None and unfolding.version != self._shown and (last or not self._lockstep):
            self._shown = unfolding.version
            broadcast.show(unfolding.part(unfolding.going, unfinished=not last))


def last_of_each_series(over: Sequence[Episode]) -> list[Episode]:
    """Of stretches that are over those after which another series of bouts begins, and the last.

    Args:
        over: The stretches, in order.
    """
    return [one for one, after in zip_longest(over, over[1:]) if after is None or after.series != one.series]


def give_way() -> None:
    """Have this thread run after whoever controls and whoever writes the log, where a thread has a rank of its own (Linux)."""
    if sys.platform == "linux":
        thread = threading.get_native_id()
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, thread, max(NICENESS, os.getpriority(os.PRIO_PROCESS, thread)))


class StopWatch:
    """Asks for the stop, and finds out whether the robots have stopped.

    Args:
        ask: Passes it on to who controls.
        within: A robot that does not say within so long, in s, that it has stopped may not have.
    """

    def __init__(self, ask: Callable[[str], None], within: float = CONFIRMED_WITHIN) -> None:
        self._ask = ask
        self._within = within
        self._changed = threading.Condition()  # its lock may be taken again by who has it
        self._networks: set[str] = set()
        self._network = ""
        self._heard: dict[tuple[str, int], float] = {}
        self._stopped: set[tuple[str, int]] = set()
        self._now = 0.0

    def stop(self) -> dict[str, Any]:
        """Ask for the stop, and wait a moment for what the robots say.

        Returns:
            `confirmed`: all that are there have said that they are stopped; `robots`: how many are there; `missing`: how many
            have not said so.
        """
        with self._changed:
            self._stopped.clear()
            self._ask(STOP)
            self._changed.wait_for(lambda: bool(self._there()) and not self._missing(), self._within)
            there, missing = len(self._there()), len(self._missing())
            return {"confirmed": there > 0 and missing == 0, "robots": there, "missing": missing}

    def _there(self) -> set[tuple[str, int]]:
        return {robot for robot, last in self._heard.items() if self._now - last < HEARD_LATELY}

    def _missing(self) -> set[tuple[str, int]]:
        return self._there() - self._stopped

    def hear(self, overheard: Iterable[Overheard]) -> None:
        """Take what robots have said.

        Args:
            overheard: Entries, in order.
        """
        with self._changed:
            for one in overheard:
                if one.topic == "/bridge/open":
                    self._networks.add(one.entry().value.network)
                elif one.topic == "/bridge/step" and len(self._networks) > 1:  # a message does not say on which it came
                    self._network = one.entry().value.network
                elif one.topic == "/mavlink/heartbeat":
                    self._said(one.entry())
            self._changed.notify_all()

    def _said(self, entry: LogEntry) -> None:
        if entry.sender is None or entry.sender[0] == HOST_SYSTEM or entry.sender[1] != 1:
            return
        self._now = entry.time
        robot = self._network, entry.sender[0]
        self._heard[robot] = entry.time
        if entry.value.custom_mode == State.STOPPED:
            self._stopped.add(robot)
        else:
            self._stopped.discard(robot)
