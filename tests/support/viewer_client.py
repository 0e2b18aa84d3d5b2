"""A viewer of ours: speaks Foxglove's protocol by a library of somebody else's, and shares nothing with what serves."""

from __future__ import annotations

import json
from dataclasses import dataclass
from struct import Struct
from time import monotonic
from typing import TYPE_CHECKING, Any, Self

from websockets.sync.client import connect
from websockets.typing import Subprotocol

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

SUBPROTOCOL = "foxglove.sdk.v1"
PATIENCE = 10.0
"""For what is certain to come, in s."""
LONGEST = 60.0
"""For what is wanted to come among others, in s: time is told without end."""
MESSAGE, TIME, SERVICE_RESPONSE, PLAYBACK_STATE = 1, 2, 3, 5
"""First bytes of what a server sends."""
SERVICE_REQUEST, PLAYBACK_REQUEST = 2, 3
"""First bytes of what a viewer sends."""
_MESSAGE_HEAD, _STATE, _REQUEST = Struct("<BIQ"), Struct("<BBQfBI"), Struct("<BBfBQI")
_CALL = Struct("<BIII")
PLAY, PAUSE = 0, 1
STATUSES = ("playing", "paused", "buffering", "ended")


@dataclass(frozen=True)
class Shown:
    """An entry that a viewer was sent."""

    topic: str
    time: int
    data: bytes


@dataclass(frozen=True)
class Told:
    """Where the server says that it stands."""

    status: str
    time: int
    speed: float
    jumped: bool
    request: str


class ViewerClient:
    """A viewer, which is connected inside it.

    Args:
        url: Of the server.
        origin: Of the page that it is; None: it is a program.
    """

    def __init__(self, url: str, origin: Any = None) -> None:  # noqa: ANN401 - the library's
        limits: Any = {"max_size": None, "max_queue": None, "compression": None}
        self._opened: Any = connect(url, subprotocols=[Subprotocol(SUBPROTOCOL)], origin=origin, **limits)
        self.info: dict[str, Any] = {}
        self.channels: dict[str, dict[str, Any]] = {}
        self.services: dict[str, dict[str, Any]] = {}
        self._topics: dict[int, str] = {}
        self.warnings: list[str] = []
        self._numbers = iter(range(1, 1 << 30))

    def __enter__(self) -> Self:
        self._socket = self._opened.__enter__()
        self.info = json.loads(self._socket.recv(PATIENCE))
        return self

    def __exit__(self, *error: object) -> None:
        self._opened.__exit__(*error)

    def next(self, wait: float = PATIENCE) -> Shown | Told | dict[str, Any] | int | None:
        """What comes next: an entry, where it stands, the answer of a service, the time; None: something else."""
        came = self._socket.recv(wait)
        if isinstance(came, str):
            self._hear(json.loads(came))
            return None
        kind = came[0]
        if kind == MESSAGE:
            _, number, time = _MESSAGE_HEAD.unpack_from(came)
            return Shown(self._topics[number], time, came[_MESSAGE_HEAD.size :])
        if kind == PLAYBACK_STATE:
            _, status, time, speed, jumped, _ = _STATE.unpack_from(came)
            return Told(STATUSES[status], time, speed, bool(jumped), came[_STATE.size :].decode())
        if kind == TIME:
            return int.from_bytes(came[1:9], "little")
        assert kind == SERVICE_RESPONSE
        encoding = _CALL.unpack_from(came)[3]
        answer: dict[str, Any] = json.loads(came[_CALL.size + encoding :])
        return answer

    def _hear(self, came: dict[str, Any]) -> None:
        if came["op"] == "advertise":
            self.channels |= {one["topic"]: one for one in came["channels"]}
        elif came["op"] == "advertiseServices":
            self.services |= {one["name"]: one for one in came["services"]}
        elif came["op"] == "status":
            self.warnings.append(came["message"])

    def until(self, wanted: Callable[[Any], bool]) -> list[Any]:
        """All that comes, up to what is wanted."""
        came: list[Any] = []
        end = monotonic() + LONGEST
        while not came or not wanted(came[-1]):
            assert monotonic() < end, f"it does not come; what came last: {came[-3:]}"
            came.append(self.next())
        return came

    def meet(self) -> None:
        """Hear which channels there are."""
        while not self.channels:
            self.next()

    def subscribe(self, topics: Iterable[str]) -> None:
        """Ask for the entries of topics."""
        wanted = []
        for topic in topics:
            number = next(self._numbers)
            self._topics[number] = topic
            wanted.append({"id": number, "channelId": self.channels[topic]["id"]})
        self._socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))

    def control(self, command: int, *, speed: float = 1.0, seek: int | None = None) -> str:
        """Ask for playing: the number of the request."""
        number = f"request {next(self._numbers)}"
        head = _REQUEST.pack(PLAYBACK_REQUEST, command, speed, seek is not None, seek or 0, len(number))
        self._socket.send(head + number.encode())
        return number

    def call(self, service: str, content: bytes = b"{}") -> dict[str, Any]:
        """Call a service, and wait for its answer."""
        head = _CALL.pack(SERVICE_REQUEST, self.services[service]["id"], next(self._numbers), len(b"json"))
        self._socket.send(head + b"json" + content)
        answer: dict[str, Any] = self.until(lambda one: isinstance(one, dict))[-1]
        return answer
