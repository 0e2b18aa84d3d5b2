"""A connection with its log, from opening to the last record."""

from __future__ import annotations

import shlex
import signal
import sys
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from importlib import metadata
from typing import TYPE_CHECKING

from firmware_protocol.address import parse_address
from firmware_protocol.errors import PeerLostError
from firmware_protocol.events import LinkNews, PeerBack, PeerLost, StreamBack, StreamStopped
from firmware_protocol.messages import PROTOCOL_MAJOR, PROTOCOL_MINOR
from hil.cli import common
from hil.cli.running import WITHOUT_A_WORD, ActiveRun
from hil.connecting import asked_for, connect, fault_option
from hil.connecting_all import connect_all
from hil.diagnosis import lost
from hil.key_file import load_key
from hil.recorder import Recorder
from hil.suspending import Suspension

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from pathlib import Path
    from types import FrameType

    from firmware_protocol.address import Address
    from firmware_protocol.events import Event
    from hil.bouts import Bout
    from hil.bridge import Bridge
    from hil.coaching import Observer
    from hil.junior import Junior
    from hil.robots import Robots
    from pal_advisor.maneuvers import Advice, PalSettings

OTHERS_WAIT = 0.25
"""How long to listen for other robots on the link, in s: each says something many times a second."""


class Session:
    """A connected robot, and the log of what happens with it.

    Attributes:
        junior: The robot.
        recorder: Writes the log; None where there is none.
        suspension: Stops the robot before Ctrl-Z stops the program; None where somebody else sees to that.
    """

    def __init__(self, junior: Junior, recorder: Recorder | None, suspension: Suspension | None = None) -> None:
        self.junior = junior
        self.recorder = recorder
        self.suspension = suspension

    @property
    def lockstep(self) -> bool:
        """Time passes only while we wait: as fast as the machine can, and repeatable."""
        return self.junior.bridge.link.lockstep

    def observers(self, settings: PalSettings) -> tuple[Observer, ...]:
        """Who takes coaching down in the log.

        Args:
            settings: How Pal rates.
        """
        if self.recorder is None:
            return ()
        self.recorder.learning(settings)
        return (self.recorder,)

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

    def finish(self, result: Mapping[str, object]) -> None:
        """Put the result into the log; paths are left out, since they differ between equal runs."""
        if self.recorder is not None:
            kept = {key: value for key, value in result.items() if key not in {"advice", "checkpoint", "log", "report"}}
            self.recorder.note("result", "done", **kept)


@contextmanager
def open_session(
    url: str,
    *,
    run: ActiveRun,
    config: Mapping[str, object],
    system: int | None = None,
    arm: bool = True,
    signing_key: Path | None = None,
    reconnect: float = 0.0,
    tell: Callable[[str], None] | None = None,
) -> Iterator[Session]:
    """Connect, with a log; on the way out stop the robot, then close the log. Ctrl-Z stops the robot, then the program.

    Args:
        url: Address.
        run: The run that this is: where its log goes, and who is told when that can't be written.
        config: What the run was asked to do, for the log.
        system: System id of the robot; None takes the first that answers.
        arm: Let its wheels turn.
        signing_key: Key file that robot and host sign with.
        reconnect: How long a robot or link that is lost is waited for, in s.
        tell: Is told, in words, when link or robot are lost or back, and which robot was taken of
            several; None for nobody.

    Yields:
        The session.

    Raises:
        LinkError: The link can't be opened.
        PeerError: No robot answers, or it falls silent.
        LogError: The log can't be written.
        KeyFileError: The key file can't be used.
    """
    address = parse_address(url)
    key = load_key(signing_key) if signing_key else None
    with ExitStack() as stack:
        stack.enter_context(terminate_as_interrupt())
        recorder = _begin_log(stack, run, url, config)
        with _nothing_said(recorder):
            taps = [recorder] if recorder else []
            junior = stack.enter_context(connect(url, system=system, taps=taps, reconnect=reconnect, signing_key=key))
        run.met(junior, emulated_here=address.scheme == "sim")
        bridges = [junior.bridge]
        suspension = Suspension(lambda: [junior], lambda: bridges, junior.step, junior.now, _noted(recorder))
        junior.between = stack.enter_context(suspension).attend
        if tell is not None:
            _tell_pace(junior.bridge, tell)
            common.tell_others(junior.peer.system, others_beside(junior, address), url, tell)
            junior.listen(_teller(junior.bridge, tell))
        if arm:
            junior.arm()
        if recorder is not None:
            recorder.metadata("robot", {name: f"{value:g}" for name, value in junior.parameters().items()})
        try:
            yield Session(junior, recorder, suspension)
        except PeerLostError as error:
            raise PeerLostError(lost(replace(junior.bridge.seen(), url=url), str(error))) from error


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


def others_beside(junior: Junior, address: Address) -> set[int]:
    """Listen for a moment who else is on the link.

    Args:
        junior: The robot that was taken.
        address: Its address; one that names the robot, or has room for one only, needs no listening.

    Returns:
        System ids of the others, as far as they are heard.
    """
    if asked_for(address) is None and (address.scheme != "sim" or "count" in address.options):
        junior.wait(OTHERS_WAIT)
    return junior.bridge.strangers


@contextmanager
def open_watch(
    link: str,
    *,
    run: ActiveRun,
    config: Mapping[str, object],
    reconnect: float = 0.0,
    tell: Callable[[str], None] | None = None,
    signing_key: Path | None = None,
) -> Iterator[tuple[Robots, Recorder | None]]:
    """Watch every robot on a link, with a log; on the way out stop those that were taken, then close the log.

    Ctrl-Z stops those that were taken, then the program.

    Args:
        link: Address.
        run: The run that this is.
        config: What the run was asked to do, for the log.
        reconnect: How long the link is tried to be opened again when it is lost, in s.
        tell: Is told, in words, when link or robots are lost or back; None for nobody.
        signing_key: Key file that host and robots sign with.

    Yields:
        The robots, and what writes the log.

    Raises:
        LinkError: The link can't be opened.
        PeerError: No robot answers.
        LogError: The log can't be written.
    """
    with ExitStack() as stack:
        stack.enter_context(terminate_as_interrupt())
        key = load_key(signing_key) if signing_key else None
        recorder = _begin_log(stack, run, link, config)
        with _nothing_said(recorder):
            taps = [recorder] if recorder else []
            robots = stack.enter_context(connect_all(link, watch=True, taps=taps, reconnect=reconnect, signing_key=key))
        members, bridges = robots.members, robots.networks.bridges
        suspension = Suspension(
            lambda: list(members.values()),
            lambda: list(bridges.values()),
            robots.step,
            robots.now,
            _noted(recorder),
        )
        robots.between = stack.enter_context(suspension).attend
        if tell is not None:
            _tell_pace(next(iter(robots.networks.bridges.values())), tell)
            listener = _teller(next(iter(robots.networks.bridges.values())), tell)
            robots.listen(lambda _, event: listener(event))
        yield robots, recorder


def _noted(recorder: Recorder | None) -> Callable[[str], None] | None:
    return None if recorder is None else recorder.operator


def _begin_log(stack: ExitStack, run: ActiveRun, url: str, config: Mapping[str, object]) -> Recorder | None:
    """Begin a log that ends with the stack; None where there is to be none."""
    if run.log is None:
        return None
    recorder = open_recorder(run, run.log, url, config, lockstep=parse_address(url).scheme == "sim")
    stack.callback(recorder.close)
    return recorder


@contextmanager
def _nothing_said(recorder: Recorder | None) -> Iterator[None]:
    """Keep no log of a link that could not be opened."""
    try:
        yield
    except WITHOUT_A_WORD:
        if recorder is not None:
            recorder.discard()
        raise


def open_recorder(run: ActiveRun, log: Path, url: str, config: Mapping[str, object], *, lockstep: bool) -> Recorder:
    """Begin a log.

    Args:
        run: The run that this is: it is told when the log can't be written any further.
        log: Where it goes.
        url: Address of the robot.
        config: What the run was asked to do.
        lockstep: The link is in lock-step.

    Returns:
        What writes it; to be closed.

    Raises:
        AddressError: The address asks for faults, and something of them is wrong.
        LogError: The log can't be written.
    """
    described = {key: str(value) for key, value in config.items()}
    faults = fault_option(parse_address(url))
    if faults is not None:  # also where the address names a file, which may be another tomorrow
        described["faults"] = str(faults)
    described |= {
        "version": metadata.version("junior-hil"),
        "protocol": f"{PROTOCOL_MAJOR}.{PROTOCOL_MINOR}",
        "link": url,
    }
    about = {
        "started": datetime.now(UTC).isoformat(),
        "command": shlex.join(["hil", *sys.argv[1:]]),
        "log": str(log),
        "python": sys.version.split()[0],
        "platform": sys.platform,
    }
    return Recorder(
        log,
        run=about,
        config=described,
        link=url,
        lockstep=lockstep,
        overwrite=run.overwrite,
        on_failure=run.log_failed,
    )


@contextmanager
def terminate_as_interrupt() -> Iterator[None]:
    """Let a polite kill, and a terminal that is closed, end the run as Ctrl-C does: robot stopped, files closed.

    Signals that are ignored (as under nohup) stay ignored.
    """

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    names = [name for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    before = {number: signal.getsignal(number) for number in (getattr(signal, name) for name in names)}
    caught = [number for number, handler in before.items() if handler is not signal.SIG_IGN]
    for number in caught:
        signal.signal(number, interrupt)
    try:
        yield
    finally:
        for number in caught:
            signal.signal(number, before[number])
