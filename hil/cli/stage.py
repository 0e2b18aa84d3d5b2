"""The outside as it is now: a link, a terminal, a disk."""

from __future__ import annotations

import json
import shlex
import sys
import time
from contextlib import contextmanager
from datetime import UTC, datetime
from importlib import metadata
from typing import TYPE_CHECKING, Any, TypeVar

from firmware_protocol.address import parse_address
from firmware_protocol.links.opening import open_link
from firmware_protocol.messages import PROTOCOL_MAJOR, PROTOCOL_MINOR
from hil.bridge.clock import MonotonicClock
from hil.connecting.connecting import AddressOpeners, fault_file, fault_option
from hil.connecting.network_address import networks_of
from hil.jobs.stage import Job, Stage
from hil.mcaplog.attachments import BEGUN_WITH
from hil.mcaplog.media import media_type_of
from hil.recording.process import RecorderProcess, begin_log
from hil.report.style import INSTALL, can_draw
from hil.signing.key_file import load_key
from hil.terminal.interrupts import interrupts
from hil.terminal.keys import pressed_keys
from hil.terminal.pacing import Pacer
from hil.versions import versions

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from contextlib import AbstractContextManager
    from pathlib import Path

    from rich.console import Console

    from firmware_protocol.address import Address
    from firmware_protocol.link import Link
    from hil.cli.live import LivePage
    from hil.cli.running import ActiveRun
    from hil.cli.share import SharedAddress
    from hil.cockpit.window import CockpitWindow
    from hil.connecting.connecting import NetworkOpener
    from hil.jobs.stage import Window
    from hil.recording.recorder import Recorder
    from hil.working import Crew
    from hil.working.progress import ProgressBoard
    from hil.working.recorded import Recorded

T = TypeVar("T")
R = TypeVar("R")


class LiveStage(Stage):
    """A robot that is there, or emulated now.

    Args:
        run: The run that this is: where its log goes, and who is told when something can't be written.
        job: What was asked for, for the log.
        url: Address of the robot; empty where the job has none of its own.
        console: Where words and displays go.
        quiet: Nothing but results is wanted.
        signing_key: Key file that robot and host sign with.
        options: Configuration file that options were taken from.
        reports: A report of the log may be asked for afterwards; then `close` is called at last.
        beside: The log is written by a process of its own.
        gather: In lock-step, what comes within so long comes together, in s; 0: it comes at once.
        live: What happens is shown by a window on the terminal, in real time.
        crew: Does what is done by other processes.
        page: How the run is shown in a browser while it goes on; None: not at all.
        share: How its link is shared with programs that look on; None: not at all.

    Raises:
        KeyFileError: The key file can't be used.
    """

    def __init__(
        self,
        run: ActiveRun,
        job: Job,
        url: str,
        console: Console,
        *,
        quiet: bool,
        signing_key: Path | None = None,
        options: Path | None = None,
        reports: bool = False,
        beside: bool = True,
        gather: float = 0.0,
        live: bool = False,
        crew: Crew | None = None,
        page: LivePage | None = None,
        share: SharedAddress | None = None,
    ) -> None:
        super().__init__(url, console, quiet=quiet, key=load_key(signing_key) if signing_key else None)
        self._run = run
        self._job = job
        self._options = options
        self._reports = reports
        self._beside = beside
        self._recorder: Recorder | None = None
        self._clock = MonotonicClock()
        self._openers: AddressOpeners | None = None
        self._gather = gather
        self._live = live
        self._window: CockpitWindow | None = None
        self._pacer = Pacer(self._clock)
        self._crew = crew
        self._page = page
        self._share = share

    @contextmanager
    def window(self) -> Iterator[Window | None]:
        """Inside, a display is open, where there is to be one: what is said goes there, and so do keys that are for it."""
        if not self._live:
            yield None
            return
        from hil.cockpit.window import CockpitWindow  # noqa: PLC0415 - only where there is a terminal for it

        self.operator.attach(self._pacer.wake)
        try:
            with CockpitWindow(self.url) as window:
                self._window = window
                yield window
        finally:
            self._window = None
            self.operator.detach(self._pacer.wake)
        if window.failure is not None:
            self.say(f"The display has failed ({window.failure!r}); the run has gone on without.")

    def pace(self, now: float) -> None:
        """Wait until as much time has passed as an emulated robot has lived through."""
        self._pacer.keep(now)

    def say(self, text: str) -> None:
        """Say something to whoever looks on."""
        if self._window is not None and self._window.there:
            self._window.say(text)
        else:
            super().say(text)

    def interrupts(self) -> AbstractContextManager[None]:
        """Inside, signals that ask the program to end are taken in by the bridges' steps."""
        return interrupts(self.operator)

    @contextmanager
    def keys(self) -> Iterator[Callable[[], str] | None]:
        """Inside, single keys are read from the terminal."""
        window = self._window
        with pressed_keys() if window is None else pressed_keys(window.takes, self.operator.wake) as read:
            yield read

    @contextmanager
    def lines(self, address: Address) -> Iterator[Link | None]:
        """Inside, a link is open over which another program tells what it sees."""
        with open_link(address.url) as link:
            yield link

    def opener_of(self, address: Address) -> NetworkOpener:
        """What opens the link of an address."""
        if self._openers is None:
            self._openers = AddressOpeners(key=self.key, clock=self._clock, gather=self._gather)
        return self._openers.opener_of(address)

    def results(self, function: Callable[[T], R], tasks: Sequence[T], recorded: Recorded[R], before: int) -> Iterator[R]:  # noqa: ARG002
        """What comes of tasks that the crew does."""
        assert self._crew is not None, "a job that has tasks done elsewhere has a crew"
        return self._crew.in_order(function, tasks)

    @property
    def board(self) -> ProgressBoard | None:
        """What the crew tells of how far its tasks are; None where nobody tells."""
        return None if self._crew is None else self._crew.board

    def begin_log(self) -> Recorder | None:
        """Begin the log, with what was asked for."""
        run, job = self._run, self._job
        if run.log is None:
            return None
        address = parse_address(self.url) if self.url else None
        recorder = begin_log(
            run.log,
            run=self._about(run.log),
            config=described(job, address, signed=self.key is not None),
            link="" if address is None else networks_of(address)[0].url,
            lockstep=self._lockstep,
            overwrite=run.overwrite,
            on_failure=run.log_failed,
            on_loss=run.failed,
            listens=self._reports,
            beside=self._beside or self._page is not None or self._share is not None,
            live=None if self._page is None else self._page.served(self.operator),
            share=None if self._share is None else self._share.served(self.operator),
        )
        self._recorder = recorder
        files = job.files()
        if address is not None and (faults := fault_file(address)) is not None:
            files["faults.toml"] = faults
        if self._options is not None:
            files["options.toml"] = self._options.read_bytes()
        for name, data in files.items():
            recorder.attachment(f"{BEGUN_WITH}{name}", data, media_type=media_type_of(name))
        return recorder

    def connected(self) -> None:
        """Robots are there: say where the run can be looked at."""
        if self._recorder is None:
            return
        if self._page is not None:
            self._page.announce(self._recorder, self.console)
        if self._share is not None:
            self._share.announce(self._recorder, self.say)

    def report(self, log: Path, folder: Path) -> Path:
        """Draw the report of the log, which is closed: by the process that wrote it, which has listened; else by this one.

        Args:
            log: What there is of the log.
            folder: Where the report goes.

        Returns:
            The page.

        Raises:
            LogError: The log can't be read, or the report can't be written.
        """
        page = self._recorder.report(folder) if isinstance(self._recorder, RecorderProcess) else None
        if page is None:
            from hil.report import write_report  # noqa: PLC0415 - drawing takes half a second to load

            page = write_report(log, folder).page
        if self.tell is not None and not can_draw():
            self.tell(f"The report has no pictures: {INSTALL} and hil report --overwrite add them.")
        return page

    def close(self) -> None:
        """Nothing is asked for any more: the log is closed, and a process that would draw a report ends."""
        if isinstance(self._recorder, RecorderProcess):
            self._recorder.end()
        elif self._recorder is not None:
            self._recorder.close()

    def _about(self, log: Path) -> dict[str, str]:
        """Whatever differs between two runs of the same job; the wall clock (s since 1970) and the log's, read together."""
        wall, now = time.time(), 0.0 if self._lockstep else self._clock.now()
        return {
            "command": shlex.join(["hil", *sys.argv[1:]]),
            "log": str(log),
            "python": sys.version.split()[0],
            "platform": sys.platform,
            "started": datetime.fromtimestamp(wall, UTC).isoformat(),
            "wall_clock": f"{wall:.6f}",
            "log_clock": f"{now:.6f}",
        }

    @property
    def _lockstep(self) -> bool:
        """Time is the robots' alone: they are of this process, or of processes that this one has tasks done by."""
        return not self.url or parse_address(self.url).scheme == "sim"

    def describe(self, **values: Any) -> None:  # noqa: ANN401 - fields of the run's record
        """Say more of the run in its record."""
        self._run.describe(**values)


def described(job: Job, address: Address | None, *, signed: bool) -> dict[str, str]:
    """What a log says of what was asked for: `options` and `versions` are JSON, and so are numbers and truth values.

    Args:
        job: What was asked for.
        address: Address of the robot; None: the job has none.
        signed: Frames are signed, by a key that the log does not hold.

    Raises:
        AddressError: The address asks for faults, and something of them is wrong.
    """
    faults = None if address is None else fault_option(address)
    found = {
        "verb": job.VERB,
        "link": "" if address is None else address.url,
        "seed": str(job.seed),
        "options": json.dumps(job.options(), sort_keys=True),
        "signed": json.dumps(signed),
        "version": metadata.version("junior-hil"),
        "protocol": f"{PROTOCOL_MAJOR}.{PROTOCOL_MINOR}",
        "versions": json.dumps(versions(), sort_keys=True),
    }
    if faults is not None:  # also where the address names a file, which may be another tomorrow
        found["faults"] = str(faults)
    return found
