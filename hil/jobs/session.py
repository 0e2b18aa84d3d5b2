"""A connection with its log, from opening to the last record."""

from __future__ import annotations

from contextlib import ExitStack, contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from firmware_protocol.address import parse_address
from firmware_protocol.errors import AddressError, HilError, LinkOpenError, PeerLostError
from firmware_protocol.events import LinkNews, PeerBack, PeerLost, StreamBack, StreamStopped
from hil.connecting.connecting import asked_for, connect_as
from hil.connecting.connecting_all import connect_all_as
from hil.connecting.diagnosis import lost, seen_by
from hil.connecting.handle import RobotHandle
from hil.connecting.handles import RobotHandles
from hil.connecting.network_address import whole_of
from hil.jobs.words import tell_others
from hil.mcaplog.attachments import BEGUN_WITH, ENDED_WITH
from hil.mcaplog.media import media_type_of
from hil.questions import Questions
from hil.sumo.rivals.pair import Pair
from hil.terminal.suspending import Suspension
from hil.working.errors import WorkerError
from hil.working.recorded import CUT_SHORT

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from firmware_protocol.address import Address
    from firmware_protocol.events import Event
    from hil.bridge.bridge import Bridge
    from hil.bridge.networks import Networks
    from hil.bridge.operator import Operator
    from hil.connecting.serving import Serving
    from hil.jobs.stage import Stage
    from hil.recording.recorder import Recorder
    from hil.safety import Limits
    from hil.sumo.bouts import Bout
    from hil.sumo.coaching import Observer
    from hil.sumo.junior import Junior
    from pal_advisor.maneuvers import Advice

H = TypeVar("H", bound=RobotHandle)
R = TypeVar("R", bound=RobotHandles[Any])

OTHERS_WAIT = 0.25
"""How long to listen for other robots on the link, in s: each says something many times a second."""
WITHOUT_A_WORD = (LinkOpenError, AddressError)
"""Nothing has been said when a run ends by one of these: it leaves nothing."""
ADVICE = "advice.toml"
POLICY = "policy.json"
CHECKPOINT = "checkpoint.json"
GIVEN = "given.toml"
LEARNT = "learnt-advice.toml"
"""What the files are called in a log that runs begin and end with."""


class Session(Generic[H]):
    """A connected robot, and the log of what happens with it.

    Attributes:
        robot: The robot.
        recorder: Writes the log; None where there is none.
        suspension: Stops the robot before Ctrl-Z stops the program; None where somebody else sees to that.
    """

    def __init__(self, robot: H, recorder: Recorder | None, suspension: Suspension | None = None) -> None:
        self.robot = robot
        self.recorder = recorder
        self.suspension = suspension

    @property
    def lockstep(self) -> bool:
        """Time passes only while we wait: as fast as the machine can, and repeatable."""
        return self.robot.bridge.link.lockstep

    def observers(self) -> tuple[Observer, ...]:
        """Who takes coaching down in the log."""
        return () if self.recorder is None else (self.recorder,)

    def questions(self, say: Callable[[str], None] | None = None) -> Questions:
        """What asks a person who looks on.

        Args:
            say: Says to the person at the terminal what is asked for; None: nobody is there.
        """
        return Questions(self.robot.bridge.operator, self.recorder, say)

    def note(self, kind: str, text: str, **fields: object) -> None:
        """Put an event into the log.

        Args:
            kind: What kind of event it is.
            text: What happened, in words.
            **fields: The same as plain values.
        """
        if self.recorder is not None:
            self.recorder.note(kind, text, **fields)

    def series(self, title: str) -> None:
        """Bouts from now on belong together, under this title."""
        if self.recorder is not None:
            self.recorder.series(title)

    def bout(self, bout: Bout) -> None:
        """Put a finished bout into the log."""
        if self.recorder is not None:
            self.recorder.bout(bout)

    def advice(self, advice: Advice) -> None:
        """Put what was learnt into the log."""
        if self.recorder is not None:
            self.recorder.advice(advice.to_dict())

    def attach(self, name: str, data: bytes, *, begun: bool = False) -> None:
        """Put a file into the log that the run ends with.

        Args:
            name: Its name, as `advice.toml`.
            data: Its content.
            begun: The run begins with it.
        """
        attach(self.recorder, name, data, begun=begun)

    def finish(self, result: Mapping[str, object]) -> None:
        """Put the result into the log; paths are left out, since they differ between equal runs."""
        if self.recorder is not None:
            kept = {key: value for key, value in result.items() if key not in {"advice", "checkpoint", "log", "report"}}
            self.recorder.note("result", "done", **kept)


class OnlookerAttendant:
    """Does what somebody who looks on asks for, between two steps of the links: stops the robots, reads their parameters.

    They stay stopped until they are disarmed and armed again: whatever they were to do ends by that.

    Args:
        operator: Tells of it.
        robots: Gives the robots.
        attend: What else is seen to.
        call: Tells all that hear us to stop, whoever they are, before each robot is asked; None: nobody else is there.
    """

    def __init__(
        self,
        operator: Operator,
        robots: Callable[[], Iterable[RobotHandle]],
        attend: Callable[[], None],
        call: Callable[[], None] | None = None,
    ) -> None:
        self._call = call
        self._operator = operator
        self._robots = robots
        self._attend = attend

    def attend(self) -> None:
        """Do what was asked for."""
        if self._operator.stops():
            if self._call is not None:
                self._call()
            for robot in self._robots():
                robot.ask_emergency_stop()
        read_parameters(self._operator, self._robots())
        self._attend()


def read_parameters(operator: Operator, robots: Iterable[RobotHandle]) -> None:
    """Begin to read the parameters that somebody who looks on has asked for; who asked sees them come.

    Args:
        operator: Tells of whose.
        robots: The robots.
    """
    unread = operator.unread()
    if unread:
        for robot in robots:
            if str(robot.peer.system) in unread:
                robot.peer.list_parameters()


@contextmanager
def open_session(
    make: type[H], stage: Stage, *, reconnect: float = 0.0, system: int | None = None, arm: bool = True
) -> Iterator[Session[H]]:
    """Connect, with a log; on the way out stop the robot, then close the log. Ctrl-Z stops the robot, then the program.

    Args:
        make: The kind of handle that is wanted; a robot that has not the role for it is not taken.
        stage: The outside.
        reconnect: How long a robot or link that is lost is waited for, in s.
        system: System id of the robot; None takes the first that answers.
        arm: Let its wheels turn.

    Yields:
        The session.

    Raises:
        LinkError: The link can't be opened.
        PeerError: No robot answers, or it falls silent.
        LogError: The log can't be written.
        KeyboardInterrupt: The operator asked for it.
    """
    with ExitStack() as stack:
        stack.enter_context(stage.interrupts())
        recorder = begin_log(stack, stage)
        with nothing_said(recorder):
            robot = _connected(stack, make, stage, recorder, reconnect=reconnect, system=system)
        with _taken(robot, stage, recorder, arm=arm) as session:
            yield session


@contextmanager
def open_session_within(make: type[H], stage: Stage, recorder: Recorder | None) -> Iterator[Session[H]]:
    """As `open_session`, in the midst of a run whose log is begun, and which interrupts end already.

    Args:
        make: The kind of handle that is wanted.
        stage: The outside.
        recorder: Writes the log; None where there is none.

    Yields:
        The session.

    Raises:
        LinkError: The link can't be opened.
        PeerError: No robot answers, or it falls silent.
        KeyboardInterrupt: The operator asked for it.
    """
    with ExitStack() as stack:
        robot = _connected(stack, make, stage, recorder)
        with _taken(robot, stage, recorder, arm=True) as session:
            yield session


def _connected(
    stack: ExitStack,
    make: type[H],
    stage: Stage,
    recorder: Recorder | None,
    *,
    reconnect: float = 0.0,
    system: int | None = None,
) -> H:
    """A robot, which is let go with the stack."""
    robot = connect_as(
        make,
        stage.url,
        system=system,
        taps=[recorder] if recorder else [],
        reconnect=reconnect,
        signing_key=stage.key,
        operator=stage.operator,
        opener=stage.opener_of(parse_address(stage.url)),
    )
    stack.enter_context(robot)
    return robot


@contextmanager
def _taken(robot: H, stage: Stage, recorder: Recorder | None, *, arm: bool) -> Iterator[Session[H]]:
    """Inside, a robot that is connected is seen to."""
    address, url = parse_address(stage.url), stage.url
    with ExitStack() as stack:
        stage.connected()
        if robot.uid and address.scheme != "sim":  # one of this process has an id that says nothing
            stage.describe(robot=robot.uid)
        bridges = [robot.bridge]
        suspension = _looked_on(stack, stage, robot, lambda: [robot], lambda: bridges)
        tell = stage.tell
        if tell is not None:
            _tell_pace(robot.bridge, tell)
            robot.listen(_teller(robot.bridge, tell))
        tell_others(robot.peer.system, others_beside(robot, address), url, tell)
        if arm:
            robot.arm()
        if recorder is not None:
            recorder.metadata("robot", {name: f"{value:g}" for name, value in robot.parameters().items()})
        try:
            yield Session(robot, recorder, suspension)
        except PeerLostError as error:
            raise PeerLostError(lost(replace(seen_by(robot.bridge), url=url), str(error))) from error


def _tell_pace(bridge: Bridge, tell: Callable[[str], None]) -> None:
    """Say that the robots are asked for less than they would say, where they are: that was before anybody listened."""
    if bridge.pace is not None:
        tell(f"{bridge.link.url}: {bridge.pace.text}")


def _teller(bridge: Bridge, tell: Callable[[str], None]) -> Callable[[Event], None]:
    """What tells of losses and returns."""
    patience = bridge.patience

    def listen(event: Event) -> None:
        if isinstance(event, LinkNews | StreamStopped | StreamBack):
            tell(event.text)
        elif isinstance(event, PeerBack):
            tell(f"robot {event.system} is back{', restarted' if event.rebooted else ''}")
        elif isinstance(event, PeerLost) and bridge.lost is None and patience:
            tell(f"robot {event.system} is lost: {event.cause}; waiting {patience:g} s for it")

    return listen


def others_beside(robot: RobotHandle, address: Address) -> set[int]:
    """Listen for a moment who else is on the link.

    Args:
        robot: The robot that was taken.
        address: Its address; one that names the robot, or has room for one only, needs no listening.

    Returns:
        System ids of the others, as far as they are heard.
    """
    if asked_for(address) is None and (address.scheme != "sim" or "count" in address.options):
        robot.wait(OTHERS_WAIT)
    return robot.bridge.strangers


@contextmanager
def open_watch(
    stage: Stage, *, make: Callable[[Networks, Limits], R], reconnect: float = 0.0
) -> Iterator[tuple[R, Recorder | None]]:
    """Watch every robot on a link, with a log; on the way out stop those that were taken, then close the log.

    Ctrl-Z stops those that were taken, then the program.

    Args:
        stage: The outside.
        make: Makes what holds the robots; others than those of its role are not taken.
        reconnect: How long the link is tried to be opened again when it is lost, in s.

    Yields:
        The robots, and what writes the log.

    Raises:
        LinkError: The link can't be opened.
        PeerError: No robot answers.
        LogError: The log can't be written.
        KeyboardInterrupt: The operator asked for it.
    """
    with ExitStack() as stack:
        stack.enter_context(stage.interrupts())
        recorder = begin_log(stack, stage)
        with nothing_said(recorder):
            robots = connect_all_as(
                make,
                stage.url,
                watch=True,
                taps=[recorder] if recorder else [],
                reconnect=reconnect,
                signing_key=stage.key,
                operator=stage.operator,
                opener_of=stage.opener_of,
            )
            stack.enter_context(robots)
        stage.connected()
        members, bridges = robots.members, robots.networks.bridges
        _looked_on(
            stack,
            stage,
            robots,
            lambda: list(members.values()),
            lambda: list(bridges.values()),
            call=robots.call_emergency_stop,
        )
        if stage.tell is not None:
            bridge = next(iter(bridges.values()))
            _tell_pace(bridge, stage.tell)
            listener = _teller(bridge, stage.tell)
            robots.listen(lambda _, event: listener(event))
        yield robots, recorder


@contextmanager
def open_pair_session(stage: Stage, *, reconnect: float = 0.0) -> Iterator[tuple[Session[Junior], Pair]]:
    """Connect to both robots of an emulated ring, with a log, and arm the first; see `open_session`.

    Args:
        stage: The outside; its address is that of both, or of the first's network.
        reconnect: How long a robot or link that is lost is waited for, in s.

    Yields:
        The session, of the first, and both.

    Raises:
        As `open_session`, and:
        RingError: There are not two robots.
    """
    with ExitStack() as stack:
        stack.enter_context(stage.interrupts())
        recorder = begin_log(stack, stage)
        with nothing_said(recorder):
            pair = connect_all_as(
                Pair,
                whole_of(parse_address(stage.url)),
                taps=[recorder] if recorder else [],
                reconnect=reconnect,
                signing_key=stage.key,
                operator=stage.operator,
                opener_of=stage.opener_of,
            )
            stack.enter_context(pair)
        stage.connected()
        both, bridges, home = [pair.home, pair.away], list(pair.networks.bridges.values()), pair.home
        suspension = _looked_on(stack, stage, pair, lambda: both, lambda: bridges, call=pair.call_emergency_stop)
        if stage.tell is not None:
            tell = _teller(home.bridge, stage.tell)
            pair.listen(lambda _, event: tell(event))
        home.arm()
        if recorder is not None:
            recorder.metadata("robot", {name: f"{value:g}" for name, value in home.parameters().items()})
        try:
            yield Session(home, recorder, suspension), pair
        except PeerLostError as error:
            raise PeerLostError(lost(replace(seen_by(home.bridge), url=stage.url), str(error))) from error


def _looked_on(
    stack: ExitStack,
    stage: Stage,
    served: Serving,
    robots: Callable[[], Sequence[RobotHandle]],
    bridges: Callable[[], Sequence[Bridge]],
    *,
    call: Callable[[], None] | None = None,
) -> Suspension:
    """Until the stack ends, robots are stopped and looked at as somebody who looks on asks for, and before Ctrl-Z.

    Args:
        stack: Ends it.
        stage: The outside.
        served: Serves the links.
        robots: Gives the robots.
        bridges: Gives what speaks with them.
        call: As for `OnlookerAttendant`.
    """
    suspension = Suspension(stage.operator, robots, bridges, served.step, served.now, replayed=stage.replayed)
    suspending = stack.enter_context(suspension)
    served.between = OnlookerAttendant(stage.operator, robots, suspending.attend, call).attend
    return suspension


def note_cut_short(recorder: Recorder | None, error: HilError | KeyboardInterrupt) -> None:
    """Say in a log, if there is one, why other processes gave no further result.

    Args:
        recorder: Writes the log; None where there is none.
        error: Why.
    """
    if recorder is not None:
        interrupted = isinstance(error, KeyboardInterrupt)
        status = error.status if isinstance(error, WorkerError) else 0
        recorder.note(CUT_SHORT, "interrupted" if interrupted else str(error), interrupted=interrupted, status=status)


def attach(recorder: Recorder | None, name: str, data: bytes, *, begun: bool = False) -> None:
    """Put a file into a log, if there is one, that the run ends with.

    Args:
        recorder: Writes the log; None where there is none.
        name: Its name, as `advice.toml`.
        data: Its content.
        begun: The run begins with it.
    """
    if recorder is not None:
        kind = BEGUN_WITH if begun else ENDED_WITH
        recorder.attachment(f"{kind}{name}", data, media_type=media_type_of(name))


def begin_log(stack: ExitStack, stage: Stage) -> Recorder | None:
    """Begin a log that ends with the stack; None where there is to be none."""
    recorder = stage.begin_log()
    if recorder is not None:
        stack.callback(recorder.close)
    return recorder


@contextmanager
def nothing_said(recorder: Recorder | None) -> Iterator[None]:
    """Keep no log of a link that could not be opened."""
    try:
        yield
    except WITHOUT_A_WORD:
        if recorder is not None:
            recorder.discard()
        raise
