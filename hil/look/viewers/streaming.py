"""A log streamed to Foxglove, which plays it: each entry at its time, from wherever the viewer asks."""

from __future__ import annotations

from threading import Condition, Thread
from typing import TYPE_CHECKING, Final, Self

from foxglove import Context
from foxglove.websocket import Capability, PlaybackCommand, PlaybackState, PlaybackStatus, ServerListener

from hil.look.viewers.foxglove_server import LOOPBACK, PORT, open_channel, open_server
from hil.look.viewers.playback import PlayStatus
from hil.look.viewers.schedule import Schedule

if TYPE_CHECKING:
    from collections.abc import Callable

    from foxglove.websocket import ChannelView, Client, PlaybackControlRequest

    from firmware_protocol.clock import Clock
    from hil.look.viewers.playback import PlaybackStanding
    from hil.look.viewers.recorded import RecordedEntries

TOLD_EVERY: Final = 0.05
"""While it plays, viewers are told what time it is so often, in s, also where nothing happens."""
_STATUS: Final = {
    PlayStatus.PLAYING: PlaybackStatus.Playing,
    PlayStatus.PAUSED: PlaybackStatus.Paused,
    PlayStatus.ENDED: PlaybackStatus.Ended,
}


class LogStream:
    """Serves a log to viewers, by a thread of its own. It waits at the beginning until one plays it.

    Args:
        entries: The log's entries.
        name: What viewers show it as.
        clock: Whose time entries are sent by.
        port: TCP port; 0: any that is free.
        sent: Is told of each entry that was sent by playing: by how much too late, in s.

    Attributes:
        url: What a viewer connects to.
        app_url: What shows it in Foxglove, in a browser.

    Raises:
        ViewerError: The port can't be listened on.
    """

    def __init__(
        self,
        entries: RecordedEntries,
        name: str,
        clock: Clock,
        *,
        port: int = PORT,
        sent: Callable[[float], object] | None = None,
    ) -> None:
        self._entries = entries
        self._schedule = Schedule(entries)
        self._clock = clock
        self._sent = sent
        self._changed = Condition()
        self._leaving = False
        self._context = context = Context()  # channels go when it does
        self._channels = {
            number: open_channel(context, one.topic, one.encoding, one[2:] if one.schema_name else None)
            for number, one in entries.channels.items()
        }
        self._numbers = {channel.id(): number for number, channel in self._channels.items()}
        with self._changed:  # who connects at once is answered when all is there
            self._server = open_server(
                name,
                context,
                port=port,
                listener=PlaybackListener(self),
                capabilities=[Capability.Time],
                playback=(entries.begin, entries.end),
            )
        self.url = f"ws://{LOOPBACK}:{self._server.port}"
        self.app_url = self._server.app_url() or ""
        self._thread = Thread(target=self._run, name="log stream", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Serve nobody any more."""
        with self._changed:
            self._leaving = True
            self._changed.notify_all()
        self._thread.join()
        self._server.stop()

    def control(self, *, play: bool, speed: float, seek: int | None) -> PlaybackStanding:
        """See `PlaybackClock.control`."""
        with self._changed:
            standing = self._schedule.control(self._clock.now(), play=play, speed=speed, seek=seek)
            self._changed.notify_all()
            return standing

    def welcome(self, channel: int) -> None:
        """Somebody wants to see a channel: what was sent last of it, they have missed.

        Args:
            channel: The server's number of it.
        """
        with self._changed:
            now = self._clock.now()
            self._server.broadcast_playback_state(state_of(self._schedule.playback.standing(now), None))
            for place in self._schedule.last_of(self._numbers[channel], now):
                self._send(place)

    def _run(self) -> None:
        with self._changed:
            while not self._leaving:
                playback = self._schedule.playback
                turn = self._schedule.turn(self._clock.now())
                for place in turn.places:
                    self._send(place)
                    if self._sent is not None and not turn.jumped:
                        self._sent(self._clock.now() - playback.due_at(int(self._entries.times[place])))
                now = self._clock.now()
                playing = playback.course is PlayStatus.PLAYING
                if playing or turn.places:
                    self._server.broadcast_time(playback.position(now))
                if turn.ended is not None:
                    self._server.broadcast_playback_state(state_of(turn.ended, None))
                wait = min(turn.due - now, TOLD_EVERY) if playing else turn.due - now
                if wait > 0:
                    self._changed.wait(None if wait == float("inf") else wait)

    def _send(self, place: int) -> None:
        channel = self._channels[int(self._entries.numbers[place])]
        if channel.has_sinks():
            channel.log(self._entries.data(place), log_time=int(self._entries.times[place]))


class PlaybackListener(ServerListener):
    """What viewers ask for.

    Args:
        stream: Does it.
    """

    def __init__(self, stream: LogStream) -> None:
        self._stream = stream

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:  # noqa: ARG002 - the SDK's
        """A viewer wants to see a channel."""
        self._stream.welcome(channel.id)

    def on_playback_control_request(self, playback_control_request: PlaybackControlRequest) -> PlaybackState:
        """A viewer plays, pauses, jumps, or changes the speed."""
        request = playback_control_request
        standing = self._stream.control(
            play=request.playback_command == PlaybackCommand.Play, speed=request.playback_speed, seek=request.seek_time
        )
        return state_of(standing, request.request_id)


def state_of(standing: PlaybackStanding, request: str | None) -> PlaybackState:
    """What viewers are told of where it stands.

    Args:
        standing: Where.
        request: Number of the request that this answers; None: nobody asked.
    """
    return PlaybackState(_STATUS[standing.course], standing.time, standing.speed, standing.jumped, request)
