"""A swarm with its log, from opening its links to the last record."""

from __future__ import annotations

from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

from firmware_protocol.address import parse_address
from firmware_protocol.errors import RefusedError
from firmware_protocol.events import LinkNews, PeerBack, PeerLost, StreamBack, StreamStopped
from hil.bridge.operator import KEY
from hil.jobs.session import attach, begin_log, nothing_said, read_parameters
from hil.jobs.stage import keys_taken_in
from hil.swarm.connecting import connect_swarm
from hil.swarm.poses import PoseFeed, PoseFixes
from hil.terminal.suspending import Suspension

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from typing import Any

    from firmware_protocol.events import Event
    from hil.bridge.operator import Operator
    from hil.jobs.stage import Stage
    from hil.recording.recorder import Recorder
    from hil.swarm.handle import Swarm

STOP_KEYS = frozenset({" ", "s", "S"})
"""Each is the emergency stop of all."""
SHOWN = 10
"""So many robots are named."""


class SwarmStoppedError(RefusedError):
    """The operator has pressed the emergency stop.

    Args:
        said: Who has said that it is stopped, and who has not.
        by: By what, or whom.
    """

    def __init__(self, said: str, by: str) -> None:
        super().__init__("to go on", said)
        self.args = (f"emergency stop by {by}: {said}",)


class SwarmSession:
    """A connected swarm, and the log of what happens with it.

    Attributes:
        swarm: The robots.
        recorder: Writes the log; None where there is none.
        keys: The keys that are pressed.
    """

    def __init__(self, swarm: Swarm, recorder: Recorder | None, keys: SwarmKeys) -> None:
        self.keys = keys
        self.swarm = swarm
        self.recorder = recorder

    @property
    def lockstep(self) -> bool:
        """Time passes only while we wait: as fast as the machine can, and repeatable."""
        return all(bridge.link.lockstep for bridge in self.swarm.networks.bridges.values())

    def observers(self) -> tuple[Recorder, ...]:
        """Who takes the mission down in the log."""
        return () if self.recorder is None else (self.recorder,)

    def series(self, title: str) -> None:
        """What follows belongs together, under this title."""
        if self.recorder is not None:
            self.recorder.series(title)

    def attach(self, name: str, data: bytes, *, begun: bool = False) -> None:
        """Put a file into the log that the run ends with.

        Args:
            name: Its name, as `tables.toml`.
            data: Its content.
            begun: The run begins with it.
        """
        attach(self.recorder, name, data, begun=begun)

    def finish(self, **result: Any) -> None:  # noqa: ANN401 - plain values
        """Put the result into the log."""
        if self.recorder is not None:
            self.recorder.note("result", "done", **result)


class SwarmKeys:
    """Sees to the keys that are pressed, and to what is said of where robots are, between two steps of the links.

    Args:
        swarm: The robots.
        operator: Whose keys they are.
        attend: What else is seen to.
    """

    def __init__(self, swarm: Swarm, operator: Operator, attend: Callable[[], None]) -> None:
        self._swarm = swarm
        self._operator = operator
        self._attend = attend
        self._stopping = False
        self._pressed: set[str] = set()
        self._fixes = PoseFixes(swarm)

    def wait_for(self, keys: frozenset[str]) -> None:
        """Wait until one of some keys is pressed; the robots are looked after meanwhile.

        Args:
            keys: Which.

        Raises:
            SwarmStoppedError: A stop key was.
            KeyboardInterrupt: The operator asked for it.
        """
        self._pressed.clear()
        while not self._pressed & keys:
            self._swarm.step()

    def attend(self) -> None:
        """Stop all where a stop key was pressed, or somebody who looks on asks for it.

        Raises:
            SwarmStoppedError: One was.
        """
        self._attend()
        self._fixes.take(self._operator.poses())
        read_parameters(self._operator, self._swarm.members.values())
        if self._stopping:  # stopping takes steps too
            return
        pressed = {one.what.removeprefix(KEY) for one in self._operator.pressed()}
        self._pressed |= pressed
        if self._operator.stops() or pressed & STOP_KEYS:
            self._stopping = True
            answers = self._swarm.stop()
            silent = sorted(answers.errors)
            said = f"{len(answers.values)} robots have said that they are stopped"
            if silent:
                named = ", ".join(map(str, silent[:SHOWN]))
                said += f"; {len(silent)} have not, look after them: {named}{', ...' if len(silent) > SHOWN else ''}"
            raise SwarmStoppedError(said, "key" if pressed & STOP_KEYS else "who looks on")


@contextmanager
def open_swarm(
    stage: Stage, links: Sequence[str], *, reconnect: float, quorum: float, poses: str = ""
) -> Iterator[SwarmSession]:
    """Connect to all micro-robots on some links, with a log; on the way out stop them, then close the log.

    Ctrl-Z stops the robots, then the program; Space and s are the emergency stop.

    Args:
        stage: The outside.
        links: Addresses of the links; the first is the stage's.
        reconnect: How long links and robots that are lost are waited for, in s.
        quorum: Least share of each class that must be there.
        poses: Address of the link over which a camera's program tells where robots are; empty: none does.

    Yields:
        The session.

    Raises:
        LinkError: A link can't be opened.
        PeerError: No robot answers, or too few do.
        LogError: The log can't be written.
        SwarmStoppedError: The operator has pressed the emergency stop.
        KeyboardInterrupt: The operator asked for it.
    """
    with ExitStack() as stack:
        stack.enter_context(stage.interrupts())
        recorder = begin_log(stack, stage)
        with nothing_said(recorder):
            swarm = stack.enter_context(
                connect_swarm(
                    *links,
                    taps=[recorder] if recorder else [],
                    reconnect=reconnect,
                    quorum=quorum,
                    signing_key=stage.key,
                    operator=stage.operator,
                    opener_of=stage.opener_of,
                )
            )
        stage.connected()
        members, bridges = swarm.members, swarm.networks.bridges
        suspension = Suspension(
            stage.operator,
            lambda: list(members.values()),
            lambda: list(bridges.values()),
            swarm.step,
            swarm.now,
            replayed=stage.replayed,
        )
        stack.enter_context(suspension)
        stack.enter_context(keys_taken_in(stage))
        if poses:
            stack.enter_context(_poses_taken_in(stage, poses))
        keys = SwarmKeys(swarm, stage.operator, suspension.attend)
        swarm.between = keys.attend
        if stage.tell is not None:
            swarm.listen(_teller(swarm, stage.tell))
        if recorder is not None:
            recorder.metadata("swarm", {name: str(kind) for name, kind in zip(swarm.labels, swarm.kinds.tolist(), strict=True)})
        yield SwarmSession(swarm, recorder, keys)


@contextmanager
def _poses_taken_in(stage: Stage, url: str) -> Iterator[None]:
    """Inside, the bridges' steps take in what is said of where robots are."""
    with stage.lines(parse_address(url)) as link:
        if link is not None:
            stage.operator.feed = PoseFeed(link).inputs
        try:
            yield
        finally:
            stage.operator.feed = None


def _teller(swarm: Swarm, tell: Callable[[str], None]) -> Callable[[str, Event], None]:
    """What tells of losses and returns."""
    names = dict(zip(swarm.addresses_by_row, swarm.labels, strict=True))

    def listen(network: str, event: Event) -> None:
        if isinstance(event, LinkNews | StreamStopped | StreamBack):
            tell(f"{network}: {event.text}" if len(swarm.networks.bridges) > 1 else event.text)
        elif isinstance(event, PeerBack | PeerLost):
            name = next((names[at] for at in names if at.network == network and at.system == event.system), "")
            if not name:
                return
            if isinstance(event, PeerBack):
                tell(f"robot {name} is back{', restarted' if event.rebooted else ''}")
            else:
                tell(f"robot {name} is lost: {event.cause}")

    return listen
