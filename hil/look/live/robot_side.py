"""The live page of emulated robots that are served: what passes on their lines, and what somebody does to them by hand.

What passes is handed to a process of its own as bytes, which decodes, gathers and serves the page: it costs whoever lets the
robots live a queue's entry for each, and nothing of theirs waits for it. No log is kept.
"""

from __future__ import annotations

import os
from collections import deque
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from hil.bridge.taps import Opening
from hil.look.live.choices import LIFT, POWER_OFF, POWER_ON, PUT_DOWN
from hil.questions import ASKED
from hil.recording.handover import HEARD
from hil.recording.process import Live, RecorderProcess
from simdevice.serving.endpoints import Endpoint

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

FROM_HOST, FROM_ROBOTS = 0, 1
"""Which way bytes go."""


class Handled(Protocol):
    """Emulated robots as somebody beside them handles them.

    Attributes:
        count: How many they are.
        liftable: They can be held up.
    """

    count: int
    liftable: bool

    def power(self, *, on: bool) -> None:
        """Switch them on, or off."""
        ...

    def hold_up(self, *, up: bool) -> None:
        """Lift them off the ground, or put them back."""
        ...


class RobotSide:
    """Shows emulated robots on a page, and does to them what is asked for there.

    Args:
        robots: The robots.
        networks: Address and wire of each line.
        about: What differs between two runs of the same command: command line, time of the start.
        public: Others on the network may look on.
        failed: Is told, in words, that the page is not served any further.

    Attributes:
        recorder: Hands over what passes; its `page` is the page's address.

    Raises:
        LogError: No process for it can be started.
    """

    def __init__(
        self,
        robots: Handled,
        networks: Sequence[tuple[str, str]],
        about: dict[str, str],
        *,
        public: bool,
        failed: Callable[[str], None],
    ) -> None:
        self._robots = robots
        self._asked: deque[str] = deque()
        self._on, self._up = True, False
        self._wires = [wire for _, wire in networks]
        self.recorder = RecorderProcess(
            Path(os.devnull),
            run=about,
            config={"link": ", ".join(url for url, _ in networks)},
            link=networks[0][0],
            lockstep=False,
            on_failure=lambda text, _: failed(text),
            live=Live(lambda what, _robot: self._asked.append(what), public=public, robot_side=True),
        )
        if len(networks) > 1:
            for url, wire in networks:
                self.recorder.of_network(url).opened(Opening(url, url, wire, lockstep=False, clock=0.0))
        self._tell()

    def overheard(self, endpoint: Endpoint, number: int = 0) -> Endpoint:
        """An endpoint whose bytes are shown.

        Args:
            endpoint: Where a client comes.
            number: Of its network, from 0.
        """
        return _OverheardEndpoint(endpoint, self, number)

    def heard(self, number: int, way: int, time: float, data: bytes) -> None:
        """Take what has passed on a line.

        Args:
            number: Of its network, from 0.
            way: `FROM_HOST`, or `FROM_ROBOTS`.
            time: When, in s.
            data: It.
        """
        feed = self.recorder.begin_step(time, [(time, data)])
        feed.add((HEARD, number if len(self._wires) > 1 else -1, way, self._wires[number], time, data))

    def attend(self) -> None:
        """Do what was asked for; called by who lets the robots live, between two control periods."""
        while self._asked:
            what = self._asked.popleft()
            if what in {POWER_OFF, POWER_ON}:
                self._on = what == POWER_ON
                self._robots.power(on=self._on)
            elif what in {LIFT, PUT_DOWN}:
                self._up = what == LIFT
                self._robots.hold_up(up=self._up)
            self._tell()

    def close(self) -> None:
        """They are served no longer."""
        self.recorder.close()

    def _tell(self) -> None:
        """Say how they are, and what may be done."""
        choices = [POWER_OFF if self._on else POWER_ON]
        if self._robots.liftable:
            choices.append(PUT_DOWN if self._up else LIFT)
        robots, have, are = ("The robot", "has", "is") if self._robots.count == 1 else ("The robots", "have", "are")
        held = f", and {are} held up" if self._up else ""
        self.recorder.note(ASKED, f"{robots} {have} {'' if self._on else 'no '}power{held}.", choices=choices)


class _OverheardEndpoint(Endpoint):
    """An endpoint whose bytes are shown.

    Args:
        endpoint: The endpoint.
        side: Is told of them.
        number: Of its network.
    """

    def __init__(self, endpoint: Endpoint, side: RobotSide, number: int) -> None:
        self.url, self.wire = endpoint.url, endpoint.wire
        self._endpoint = endpoint
        self._side = side
        self._number = number

    def receive(self, now: float) -> bytes:
        """See `Endpoint.receive`."""
        data = self._endpoint.receive(now)
        if data:
            self._side.heard(self._number, FROM_HOST, now, data)
        return data

    def send(self, data: bytes, now: float) -> None:
        """See `Endpoint.send`."""
        if data:
            self._side.heard(self._number, FROM_ROBOTS, now, data)
        self._endpoint.send(data, now)

    def files(self) -> list[int]:
        """See `Endpoint.files`."""
        return self._endpoint.files()

    def poll(self, now: float) -> None:
        """See `Endpoint.poll`."""
        self._endpoint.poll(now)

    def room(self) -> int | None:
        """See `Endpoint.room`."""
        return self._endpoint.room()

    def due(self) -> float:
        """See `Endpoint.due`."""
        return self._endpoint.due()

    def close(self) -> None:
        """See `Endpoint.close`."""
        self._endpoint.close()
