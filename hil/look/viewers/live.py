"""A run that goes on, shown in Foxglove: what is written into its log goes to viewers too, by the process that writes it."""

from __future__ import annotations

from threading import Event, Lock, Thread
from typing import TYPE_CHECKING, Any, Final

from foxglove import Context, StatusLevel
from foxglove.websocket import Capability, ServerListener

from hil.look.live.overhearing import OverhearingSink
from hil.look.live.showing import DIED, ENDED, StopWatch
from hil.look.viewers.foxglove_server import LOOPBACK, PORT, ViewerError, open_channel, open_server, stop_service

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from foxglove import Channel
    from foxglove.websocket import ChannelView, Client, WebSocketServer

    from hil.mcaplog.schemas import Schema
    from hil.mcaplog.writing.row_encoding import EntryRows
    from hil.mcaplog.writing.sink import LogSink

HEARD_EVERY: Final = 0.1
"""What robots say of having stopped is looked at so often, in s."""
TO_TAKE: Final = 0.3
"""Viewers have so long to take the end, in s: what was not sent is gone with the server."""
_STOPPING: Final = frozenset({"/bridge/open", "/bridge/step", "/mavlink/heartbeat"})
"""Topics that tell whether robots have stopped."""


class ViewedSink:
    """Hands a log's entries on, and to viewers those that one of them asks for; a `LogSink`.

    Args:
        sink: Where entries go.
        context: Whose channels viewers are told of.
    """

    def __init__(self, sink: LogSink, context: Context) -> None:
        self._sink = sink
        self._context = context
        self._channels: dict[int, Channel] = {}
        self._last: dict[int, tuple[int, bytes]] = {}
        """The last entry of each channel, by the server's number: its log time in ns, and itself."""
        self._telling = Lock()
        self.metadata = sink.metadata
        self.attachment = sink.attachment
        self.flush = sink.flush
        self.close = sink.close
        self.discard = sink.discard

    def channel(self, topic: str, schema: Schema) -> int:
        """See `LogSink.channel`."""
        number = self._sink.channel(topic, schema)
        if number not in self._channels:
            self._channels[number] = open_channel(self._context, topic, "protobuf", (schema.name, "protobuf", schema.data))
        return number

    def raw_channel(
        self, topic: str, schema_name: str, schema: bytes, *, schema_encoding: str = "protobuf", encoding: str = "protobuf"
    ) -> int:
        """See `LogSink.raw_channel`."""
        number = self._sink.raw_channel(topic, schema_name, schema, schema_encoding=schema_encoding, encoding=encoding)
        if number not in self._channels:
            self._channels[number] = open_channel(self._context, topic, encoding, (schema_name, schema_encoding, schema))
        return number

    def write(self, channel: int, time: float, data: bytes) -> None:
        """See `LogSink.write`."""
        self._sink.write(channel, time, data)
        self._tell(channel, time, data)

    def write_rows(self, parts: Sequence[EntryRows]) -> None:
        """See `LogSink.write_rows`; of a kind that no viewer asks for, the last alone is kept."""
        self._sink.write_rows(parts)
        for part in parts:
            first = 0 if self._channels[part.channel].has_sinks() else max(0, len(part.times) - 1)
            for time, row in zip(part.times[first:].tolist(), part.data[first:], strict=True):
                self._tell(part.channel, time, row.tobytes())

    def _tell(self, number: int, time: float, data: bytes) -> None:
        channel = self._channels[number]
        stamp = max(0, round(time * 1e9))
        with self._telling:
            self._last[channel.id()] = stamp, data
            if channel.has_sinks():
                channel.log(data, log_time=stamp)

    def repeat(self, server_number: int) -> None:
        """Tell once more what was told last of a channel: somebody has come who missed it.

        Args:
            server_number: The server's number of the channel.
        """
        with self._telling:
            found = self._last.get(server_number)
            channel = next((one for one in self._channels.copy().values() if one.id() == server_number), None)
            if found is not None and channel is not None:
                channel.log(found[1], log_time=found[0])


class MissedListener(ServerListener):
    """Shows who comes late what was shown last.

    Args:
        sink: Knows it.
    """

    def __init__(self, sink: ViewedSink) -> None:
        self._sink = sink

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:  # noqa: ARG002 - the SDK's
        """A viewer wants to see a channel."""
        self._sink.repeat(channel.id)


class LiveViewers:
    """Shows a run to viewers while it goes on, in the place of a page of our own.

    Args:
        sink: What takes the log's entries.
        ask: Is told what is asked for, in whatever thread: the stop.
        port: TCP port; where it is taken, any that is free.

    Attributes:
        sink: Where entries go now.
        url: What a viewer connects to.

    Raises:
        ViewerError: No port can be listened on.
    """

    def __init__(self, sink: LogSink, ask: Callable[[str], None], *, port: int = PORT) -> None:
        self._overheard = OverhearingSink(sink, _STOPPING)
        self._context = Context()  # channels go when it does
        viewed = ViewedSink(self._overheard, self._context)
        self.sink: LogSink = viewed
        self._stops = StopWatch(ask)
        self._leaving = Event()
        self._answering = Lock()
        try:
            self._server = self._open(viewed, port)
        except ViewerError:
            self._server = self._open(viewed, 0)
        self.url = f"ws://{LOOPBACK}:{self._server.port}"
        self._thread = Thread(target=self._run, name="what viewers ask for", daemon=True)
        self._thread.start()

    def _open(self, sink: ViewedSink, port: int) -> WebSocketServer:
        return open_server(
            "a run that goes on",
            self._context,
            port=port,
            listener=MissedListener(sink),
            capabilities=[Capability.Services],
            services=[stop_service(self._stop)],
        )

    def await_browser(self) -> None:
        """None is started for viewers."""

    def finish(self, *, died: bool = False) -> None:
        """The run is over: tell everybody who looks on.

        Args:
            died: Nobody has said so.
        """
        with self._answering:  # who has asked for the stop is told what came of it
            self._server.publish_status(DIED if died else ENDED, StatusLevel.Error if died else StatusLevel.Info)
        self._leaving.wait(TO_TAKE)
        self._leaving.set()
        self._thread.join()
        self._server.stop()

    def _stop(self) -> dict[str, Any]:
        with self._answering:
            return self._stops.stop()

    def _run(self) -> None:
        while not self._leaving.wait(HEARD_EVERY):
            self._stops.hear(self._overheard.take())
