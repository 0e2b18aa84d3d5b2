"""A recorder whose log is written by another process."""

from __future__ import annotations

import json
from dataclasses import dataclass
from os import fspath
from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import LinkOpenError
from firmware_protocol.events import Rejected
from firmware_protocol.messages import HOST_COMPONENT, HOST_SYSTEM
from hil.bridge.taps import NOTHING
from hil.files.outputs import Output, OutputExistsError, is_special
from hil.mcaplog.errors import LogError
from hil.recording import handover as kinds
from hil.recording.feeds import LockstepFeed, RealTimeFeed
from hil.recording.handover import MESSAGE_VALUES, PIECE_SIZE, RECORD_VALUES, circumstances, exact, packed_batch
from hil.recording.pipe import HelperPipe, can_start
from hil.recording.recorder import Recorder
from hil.recording.wire_log import Network, OneOfSeveral

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from firmware_protocol.events import Received
    from firmware_protocol.wire.batch import Arrivals
    from firmware_protocol.wire.fields import Message
    from firmware_protocol.wire.rows import Rows
    from hil.bridge.taps import Circumstances, Tap
    from hil.recording.feeds import Feed


OWN: Final = -1
"""In place of a number: the recorder's own network."""
AFTERWARDS: Final = -2
"""Number of the batch that comes after the last."""


@dataclass(frozen=True)
class Live:
    """How a run is shown while it goes on.

    Attributes:
        asked: Is told, by a thread, what somebody asks for who looks on, and of which robot (empty: of all).
        public: Others on the network may look on.
        robot_side: It is emulated robots that are served, and what is asked for is done to them by hand.
        viewer: By what: a page of our own, or `hil.recording.pipe.FOXGLOVE`.
    """

    asked: Callable[[str, str], None]
    public: bool = False
    robot_side: bool = False
    viewer: str = "page"


@dataclass(frozen=True)
class LinkSharing:
    """How the link of a run is shared with programs that look on.

    Attributes:
        asked: Is told, by a thread, what one of them asks for, and of which robot (empty: of all).
        host: Address of this machine at which they come.
        port: Port; 0: any that is free.
        driver: Name of the verb that drives.
    """

    asked: Callable[[str, str], None]
    host: str
    port: int
    driver: str


class RecorderProcess(Recorder):
    """Records as `Recorder` does, the same bytes, with little of the control process's time.

    What the bridge and others tell is handed over to a process of ours, which encodes, compresses and writes. In lock-step
    nothing is ever lost: where the other process can't follow, a step waits for it. In real time nothing waits; if more than
    two minutes' worth is waiting to be written, what comes is lost, until there is room again, counted and told of.

    The log is whole up to the last batch when this process is killed, and up to the last flush when the other one is.

    Args:
        path: The log file.
        run: Whatever differs between two runs of the same seed: wall clock, command line, paths.
        config: Program version, protocol version, seed, configuration; as text.
        link: Name of the network: the address of its link. Of several, that of the first.
        lockstep: The link is in lock-step.
        system: MAVLink system id of the host.
        component: MAVLink component id of the host.
        overwrite: A file that exists is replaced, when the log is whole.
        on_failure: Is told, in words, when the log can't be written any further, and which file holds what there is of it
            (None: no file does), once, by the next step or by `close`; the run goes on without a log. Without it, a LogError
            is raised there.
        on_loss: Is told, in words, what was lost, when there is room again; the log tells it too.
        listens: A report may be asked for when the log is closed: the other process gathers it meanwhile, and stays until
            `end`.
        live: Shows the run in a browser while it goes on; None: nobody looks on.
        share: Shares the link with other programs; None: there are none.

    Attributes:
        lost: Entries that were lost so far.
        feed: Hands over.
        page: Address of the page that shows it; empty where none does.
        unseen: Why it can't be shown; empty where it is, or need not be.
        shared: Address at which the link is shared; empty where it is not.

    Raises:
        LinkOpenError: The link can't be shared at that address.
        OutputExistsError: There is a file already, and it may not be replaced.
        LogError: The file cannot be created, or no process started.
    """

    def __init__(
        self,
        path: Path,
        *,
        run: Mapping[str, str],
        config: Mapping[str, str],
        link: str,
        lockstep: bool,
        system: int = HOST_SYSTEM,
        component: int = HOST_COMPONENT,
        overwrite: bool = False,
        on_failure: Callable[[str, Path | None], None] | None = None,
        on_loss: Callable[[str], None] | None = None,
        listens: bool = False,
        live: Live | None = None,
        share: LinkSharing | None = None,
    ) -> None:
        self.path = path
        self.page = self.unseen = self.shared = ""
        self._listens = listens
        self.lost = 0
        self._network = _HandedNetwork(self, link, OWN)
        self.now = 0.0
        self._networks = 0
        self._closed = False
        self._told = False
        self._on_failure = on_failure
        self._on_loss = on_loss
        # A file is made here, so that whatever is wrong with it is raised, without waiting for the other process.
        output = None if is_special(path) else _begin(path, overwrite=overwrite)
        beside = None if output is None else output.hand_over()
        self._kept = beside or path
        settings = {
            "path": fspath(path), "begun": output is not None, "beside": None if beside is None else fspath(beside),
            "run": dict(run), "config": dict(config), "link": link, "lockstep": lockstep,
            "system": system, "component": component, "overwrite": overwrite, "listens": listens,
            "live": None if live is None else _shown(live),
            "share": None if share is None else {"host": share.host, "port": share.port, "driver": share.driver},
        }  # fmt: skip
        asker = live or share
        try:
            self._pipe = HelperPipe(settings, lockstep=lockstep, asked=(lambda *_: None) if asker is None else asker.asked)
        except OSError as error:
            if output is not None:
                output.discard()
            raise LogError(f"cannot write the log {path}: no process for it can be started: {error.strerror}") from error
        if live is not None:
            self._see_served()
        refused = None if share is None else self._see_shared(share)
        if output is None:
            self._see_opened()
        self.feed: Feed = LockstepFeed(self._pipe.send) if lockstep else RealTimeFeed(self._pipe.send, self._lose)
        if refused is not None:
            self.discard()
            raise refused

    @property
    def pid(self) -> int:
        """Process id of the process that writes."""
        return self._pipe.pid

    # --- the bridge's tap --------------------------------------------------------------------------------------------

    def of_network(self, name: str) -> Tap:
        """See `Recorder.of_network`."""
        self.feed.keep((kinds.NETWORK, name))
        self._networks += 1
        return OneOfSeveral(self, _HandedNetwork(self, name, self._networks - 1))

    def step(self, time: float, chunks: Sequence[tuple[float, bytes]], met: Circumstances = NOTHING) -> None:
        """See `Recorder.step`."""
        feed = self.begin_step(time, chunks)
        feed.add((kinds.STEP, time, chunks) if met is NOTHING else (kinds.STEP, time, chunks, circumstances(met)))

    def await_browser(self) -> None:
        """A browser is being started that will look on: where the run is over sooner, it is waited for."""
        self.feed.keep((kinds.AWAITED,))

    def begin_step(self, time: float, chunks: Sequence[tuple[float, bytes]]) -> Feed:
        """A step begins, whose item is to be handed over next.

        Args:
            time: Its reading of the clock, in s.
            chunks: What it has received.

        Returns:
            What takes the item.
        """
        self.now = time
        if self._pipe.news is not None:
            self._hear()
        feed = self.feed
        feed.step(time, chunks)
        return feed

    def wire_rx(self, time: float, data: bytes) -> None:
        """See `Recorder.wire_rx`."""
        self.feed.add((kinds.RX, time, data))

    def wire_tx(self, time: float, data: bytes) -> None:
        """See `Recorder.wire_tx`."""
        self.feed.add((kinds.TX, time, data))

    def received(self, event: Received | Rejected) -> None:
        """See `Recorder.received`."""
        if isinstance(event, Rejected):
            super().received(event)
            return
        message = event.message
        found = MESSAGE_VALUES.get(type(message))
        if found is not None:
            number, values = found
            self.feed.add((kinds.RECEIVED, event.time, number, values(message), event.system, event.component, event.sequence))

    def sent(self, time: float, message: Message) -> None:
        """See `Recorder.sent`."""
        found = MESSAGE_VALUES.get(type(message))
        if found is not None:
            number, take = found
            self.feed.add((kinds.SENT, time, number, exact(take(message))))

    def arrived(self, came: Arrivals) -> None:
        """See `Recorder.arrived`."""
        others, refused = [], []
        for event, place in zip(came.events, came.places, strict=True):
            if isinstance(event, Rejected):
                refused.append(exact((place, event.reason.value, event.raw, event.time, event.detail)))
            elif (found := MESSAGE_VALUES.get(type(event.message))) is not None:
                number, values = found
                sender = (event.system, event.component, event.sequence, event.time)
                others.append((place, number, values(event.message), *sender))
        item = (kinds.ARRIVED, tuple(map(packed_batch, came.batches.values())), tuple(others), tuple(refused))
        if refused:
            self.feed.keep(item)
        else:
            self.feed.add(item)

    def sent_rows(self, time: float, message: type[Message], rows: Rows) -> None:
        """See `Recorder.sent_rows`."""
        self.feed.add((kinds.SENT_ROWS, time, message.ID, rows.tobytes()))

    # --- what happens above the bridge -------------------------------------------------------------------------------

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """See `Recorder.metadata`."""
        self.feed.keep((kinds.METADATA, name, dict(values)))

    def attachment(self, name: str, data: bytes, *, media_type: str = "application/octet-stream") -> None:
        """See `Recorder.attachment`."""
        for at in range(0, len(data), PIECE_SIZE):
            self.feed.keep((kinds.PIECE, data[at : at + PIECE_SIZE]))
        self.feed.keep((kinds.ATTACHMENT, name, media_type, self.now))

    def flush(self) -> None:
        """Hand everything to the operating system; waits until that is done."""
        if self._closed:
            return
        self.feed.keep((kinds.FLUSH,))
        self.feed.hurry()
        self._pipe.wait_for("flushed")
        self._hear()

    def close(self) -> None:
        """Finish the log, and wait until that is done; safe to repeat, and after a failure.

        Raises:
            LogError: The disk does not take the rest, and nobody else is told.
        """
        self._end((kinds.CLOSE,))

    def discard(self) -> None:
        """Leave no log: nothing has been said."""
        self._told = True  # there is nothing to be told of
        self._end((kinds.DISCARD,))

    def _end(self, item: kinds.Item) -> None:
        if self._closed:
            return
        self.feed.end(item)
        if not self._listens or self._pipe.wait_for("closed") is None:
            self._pipe.end()
        self._closed = True
        self._hear()

    def report(self, folder: Path) -> Path | None:
        """Have the report of the log drawn by the other process, which has listened; the log is closed.

        Args:
            folder: Where it goes.

        Returns:
            The page; None where it can't draw it, for whatever reason: `hil.report.write_report` can, or says why not.
        """
        if not self._listens or self._told:
            return None
        self._pipe.send(AFTERWARDS, (kinds.pack([(kinds.REPORT, fspath(folder))]),))
        answer = self._pipe.wait_for("reported")
        return None if answer is None or answer[1] is None else type(self.path)(answer[1])

    def end(self) -> None:
        """Nothing is asked for any more: the other process ends, and whatever it draws is given up. Safe to repeat."""
        self.close()
        self._pipe.kill()

    # --- in the recorder's stead -------------------------------------------------------------------------------------

    def _noted(self, kind: str, text: str, particulars: str) -> None:
        self.feed.keep((kinds.NOTE, str(kind), str(text), particulars, self.now))

    def record(self, topic: str, record: object, time: float, kind: type | None = None) -> None:
        """See `WireLog.record`."""
        number, take = RECORD_VALUES[kind or type(record)]
        self.feed.keep((kinds.RECORD, topic, number, exact(take(record)), time))

    def _see_served(self) -> None:
        """Wait until the other process serves the page."""
        answer = self._pipe.wait_for("serving")
        if answer is None:
            self.unseen = "the process that was to serve the page has ended"
        else:
            _, self.page, self.unseen = answer

    def _see_shared(self, share: LinkSharing) -> LinkOpenError | None:
        """Wait until the other process shares the link; why it can't."""
        answer = self._pipe.wait_for("sharing")
        host = f"[{share.host}]" if ":" in share.host else share.host
        url = f"tcp://{host}:{share.port}"
        if answer is None:
            return LinkOpenError(url, "the link can't be shared: the process that was to do so has ended")
        _, port, why = answer
        if why:
            return LinkOpenError(url, f"the link can't be shared there: {why}", "Choose another port; 0 is any that is free")
        self.shared = f"tcp://{host}:{port}"
        return None

    def _see_opened(self) -> None:
        """Wait until the other process has opened what is no regular file."""
        if self._pipe.wait_for("opened") is not None:
            self._hear()
            return
        self._pipe.end()
        self._closed = True
        refusal = self._pipe.refusal
        if refusal is None:
            raise LogError(f"cannot write the log {self.path}: the process that is to write it has ended")
        kind, text = refusal
        raise OutputExistsError(text) if kind == OutputExistsError.__name__ else LogError(text)

    def _lose(self, count: int) -> None:
        """There is room again, or nothing comes any more."""
        self.lost += count
        text = f"{count:,} entries of the log were lost: the disk did not take them in time"
        self._noted("recorder", text, json.dumps({"lost": count}))
        if self._on_loss is not None:
            self._on_loss(text)

    def _hear(self) -> None:
        """Tell, once, that the log is written no further."""
        news = self._pipe.news
        if news is None or self._told:
            return
        self._told = True
        word, *rest = news
        kept: Path | None
        if word == "failed":
            text, name = rest
            kept = None if name is None else type(self.path)(name)
        else:
            text, kept = self._died(rest[0])
        if self._on_failure is None:
            raise LogError(text)
        self._on_failure(text, kept)

    def _died(self, status: int) -> tuple[str, Path | None]:
        """What to say of a process that is no more."""
        how = f"was killed by signal {-status}" if status < 0 else f"has ended with status {status}"
        kept = self._kept if self._kept.is_file() and self._kept.stat().st_size else None
        rest = "nothing of it is kept" if kept is None else f"what there is of it is in {kept}"
        return f"the log {self.path} cannot be written any further: the process that writes it {how}; {rest}", kept


class _HandedNetwork(Network):
    """The steps and the bytes of one of several networks, handed over.

    Args:
        recorder: Hands over.
        name: Name of the network.
        number: Its number, from 0; `OWN` for the recorder's own.
    """

    def __init__(self, recorder: RecorderProcess, name: str, number: int) -> None:
        self.name = name
        self._recorder = recorder
        self._number = number

    def step(self, time: float, chunks: Sequence[tuple[float, bytes]], met: Circumstances) -> None:
        """See `Tap.step`."""
        more = () if met is NOTHING else (circumstances(met),)
        self._recorder.begin_step(time, chunks).add((kinds.OF_NETWORK, self._number, kinds.STEP, time, chunks, *more))

    def wire_rx(self, time: float, data: bytes) -> None:
        """See `Tap.wire_rx`."""
        self._recorder.feed.add((kinds.OF_NETWORK, self._number, kinds.RX, time, data))

    def wire_tx(self, time: float, data: bytes) -> None:
        """See `Tap.wire_tx`."""
        self._recorder.feed.add((kinds.OF_NETWORK, self._number, kinds.TX, time, data))


def _shown(live: Live) -> dict[str, bool | str]:
    """How it is shown, for the other process."""
    return {"public": live.public, "robot_side": live.robot_side, "viewer": live.viewer}


def _begin(path: Path, *, overwrite: bool) -> Output:
    try:
        return Output(path, overwrite=overwrite)
    except OSError as error:
        raise LogError(f"cannot write the log {path}: {error.strerror}. Choose another place, or do without") from error


def begin_log(
    path: Path,
    *,
    run: Mapping[str, str],
    config: Mapping[str, str],
    link: str,
    lockstep: bool,
    overwrite: bool = False,
    on_failure: Callable[[str, Path | None], None] | None = None,
    on_loss: Callable[[str], None] | None = None,
    listens: bool = False,
    beside: bool = True,
    live: Live | None = None,
    share: LinkSharing | None = None,
) -> Recorder:
    """Begin a log, written by a process of its own; by this one where it is asked to, or can't be started once more.

    A Python that is built into another program can't be.

    Args:
        path: As of `RecorderProcess`, like all others.
        run: Likewise.
        config: Likewise.
        link: Likewise.
        lockstep: Likewise.
        overwrite: Likewise.
        on_failure: Likewise.
        on_loss: Likewise.
        listens: Likewise.
        live: As of `RecorderProcess`; it needs a process of its own, and is left out where there is none.
        share: Likewise.
        beside: A process of its own is to write it: where there is a core for that, and it is worth the time that it takes to
            start.

    Raises:
        OutputExistsError: There is a file already, and it may not be replaced.
        LogError: The file cannot be created, or no process started.
        LinkOpenError: The link can't be shared at that address.
    """
    if not (beside and can_start()):
        return Recorder(path, run=run, config=config, link=link, lockstep=lockstep, overwrite=overwrite, on_failure=on_failure)
    return RecorderProcess(
        path,
        run=run,
        config=config,
        link=link,
        lockstep=lockstep,
        overwrite=overwrite,
        on_failure=on_failure,
        on_loss=on_loss,
        listens=listens,
        live=live,
        share=share,
    )
