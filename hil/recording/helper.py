"""What runs in the recorder's process: the recorder itself, fed from a pipe until that ends."""

from __future__ import annotations

import gc
import signal
import sys
from functools import partial
from itertools import chain
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any, Final, cast

from firmware_protocol.errors import HilError
from hil.files.outputs import Output
from hil.mcaplog.writing.writer import CUT, LogWriter
from hil.recording.handover import CLOSE, DISCARD, Playback, unpack
from hil.recording.pipe import FOXGLOVE, frame, read_frame
from hil.recording.recorder import Recorder
from hil.recording.wire_log import FLUSH

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import BinaryIO

    from hil.look.live.showing import Showing
    from hil.look.viewers.live import LiveViewers
    from hil.mcaplog.writing.sink import LogSink
    from hil.recording.handover import Item
    from hil.report.listening import ListeningRecorder
    from hil.sharing.sharing import Sharing

SYNC_REAL_TIME: Final = 1.0
"""Log time between two times that the disk is made to have what was written, in s; in lock-step only the end is."""


def main() -> None:
    """Write a log as the settings and batches say that come by the standard input; answers go to the standard output.

    Where the input ends without a word, the control process is no more: the log is finished all the same, and says so.
    """
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGTSTP", "SIGBREAK"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    gc.freeze()  # what is loaded stays: nobody need look through it for rubbish
    gc.enable()
    incoming, outgoing = sys.stdin.buffer, sys.stdout.buffer
    settings = read_frame(incoming)
    if settings is not None:
        _Helper(settings, outgoing).serve(incoming)


class _Helper:
    """Writes one log.

    Args:
        settings: What to begin with.
        outgoing: Where answers go.
    """

    def __init__(self, settings: dict[str, Any], outgoing: BinaryIO) -> None:
        self._settings = settings
        self._outgoing = outgoing
        self._failed = False
        self._answering = Lock()
        self._showing: Showing | LiveViewers | None = None
        self._sharing: Sharing | None = None

    def serve(self, incoming: BinaryIO) -> None:
        """Write the log.

        Args:
            incoming: Where batches come from.
        """
        try:
            recorder = self._open()
        except Exception as error:  # noqa: BLE001 - whatever it is, the control process has somebody to tell it to
            self._answer("refused", type(error).__name__, str(error))
            return
        self._answer("opened")
        self._record(recorder, incoming)

    def _open(self) -> Recorder:
        settings = self._settings
        path, lockstep = Path(settings["path"]), settings["lockstep"]
        beside = settings["beside"]
        writer = LogWriter(
            path,
            run=settings["run"],
            flush_every=FLUSH,
            long_chunks=lockstep,
            overwrite=settings["overwrite"],
            on_failure=self._tell_failure,
            sync_every=0.0 if lockstep else SYNC_REAL_TIME,
            output=Output.taken_over(path, Path(beside) if beside else None) if settings["begun"] else None,
        )
        sink = writer if settings["live"] is None else self._show(writer, settings["live"])
        if settings["share"] is not None:
            self._share(settings["share"])
        kind: Callable[..., Recorder] = Recorder
        if settings["listens"]:
            from hil.report.listening import ListeningRecorder  # noqa: PLC0415 - only where a report may be wanted

            kind = ListeningRecorder
        return kind(
            path,
            run=settings["run"],
            config=settings["config"],
            link=settings["link"],
            lockstep=lockstep,
            system=settings["system"],
            component=settings["component"],
            writer=sink,
        )

    def _show(self, writer: LogWriter, live: dict[str, Any]) -> LogSink:
        """Show what is written while it is; where that can't be, the log is written all the same."""
        try:
            self._showing = self._viewed(writer) if live["viewer"] == FOXGLOVE else self._page(writer, live)
        except (OSError, HilError) as error:
            self._answer("serving", "", str(error))
            return writer
        self._answer("serving", self._showing.url, "")
        return self._showing.sink

    def _ask(self, what: str) -> None:
        """Pass on what is asked for on the page, of all robots."""
        self._answer("asked", what, "")

    def _share(self, share: dict[str, Any]) -> None:
        """Share the link with programs that look on."""
        from hil.sharing.sharing import Sharing  # noqa: PLC0415 - only where somebody may

        try:
            self._sharing = Sharing(**share, ask=partial(self._answer, "asked"))
        except OSError as error:
            self._answer("sharing", 0, error.strerror or str(error))
        else:
            self._answer("sharing", self._sharing.port, "")

    def _page(self, writer: LogWriter, live: dict[str, Any]) -> Showing:
        from hil.look.live.showing import Showing  # noqa: PLC0415 - only where somebody looks on

        settings, how = self._settings, {name: value for name, value in live.items() if name != "viewer"}
        return Showing(writer, settings["run"], self._ask, lockstep=settings["lockstep"], **how)

    def _await_browser(self) -> None:
        """A browser is being started that will look on."""
        if self._showing is not None:
            self._showing.await_browser()

    def _viewed(self, writer: LogWriter) -> LiveViewers:
        from hil.look.viewers.live import LiveViewers  # noqa: PLC0415 - likewise; it needs an extra

        return LiveViewers(writer, self._ask)

    def _record(self, recorder: Recorder, incoming: BinaryIO) -> None:
        playback = Playback(recorder, self._answer, partial(self._report, recorder), self._sharing, self._await_browser)
        last, taken, ended = -1, 0, False
        while (batch := read_frame(incoming)) is not None:
            number, first, packed = batch
            if number != last:
                last, taken = number, 0
            new = packed[max(0, taken - first) :]  # what was sent before it was interrupted has been taken
            taken = max(taken, first + len(packed))
            items: list[Item] = list(chain.from_iterable(map(unpack, new)))
            if self._failed:
                playback.overhear(items)
            else:
                self._play(playback, items)
            if items and items[-1][0] in {CLOSE, DISCARD}:
                ended = True
                if self._sharing is not None:
                    self._sharing.finish()
                if self._showing is not None:
                    self._showing.finish()
                self._answer("closed")
        if not ended:
            recorder.metadata(CUT, {"why": "the program that was recorded has ended without closing its log"})
            recorder.close()
            if self._sharing is not None:
                self._sharing.finish(died=True)
            if self._showing is not None:
                self._showing.finish(died=True)

    def _report(self, recorder: Recorder, folder: str) -> None:
        """Draw the report of the log, which is closed; where that fails, the control process draws it, or says why not."""
        try:
            page = cast("ListeningRecorder", recorder).report(Path(folder))
        except Exception:  # noqa: BLE001 - see above
            self._answer("reported", None)
        else:
            self._answer("reported", str(page))

    def _play(self, playback: Playback, items: list[Item]) -> None:
        try:
            playback.take(items)
        except Exception as error:  # noqa: BLE001 - as above; what there is of the log is finished
            path = playback.recorder.path
            playback.recorder.metadata(CUT, {"why": f"it could not be written any further: {error!r}"})
            playback.recorder.close()
            self._tell_failure(f"the log {path} cannot be written any further: {error!r}", path)

    def _tell_failure(self, text: str, kept: Path | None) -> None:
        self._failed = True
        self._answer("failed", text, None if kept is None else str(kept))

    def _answer(self, *answer: object) -> None:
        try:
            with self._answering:
                self._outgoing.write(frame(answer))
                self._outgoing.flush()
        except OSError:  # nobody listens any more
            pass
