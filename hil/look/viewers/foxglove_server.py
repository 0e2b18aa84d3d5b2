"""The server that Foxglove, and what speaks its protocol, connects to: foxglove-sdk's, with what we allow.

It asks nobody who they are, and any page that is open in a browser on this machine may connect. So it listens on the loopback
alone, takes no messages, and has no service but one that stops.
"""

from __future__ import annotations

import json
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.errors import HilError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from foxglove import Channel, Context, Service
    from foxglove.websocket import Capability, ServerListener, WebSocketServer

INSTALL: Final = "pip install 'foxglove-sdk>=0.30'"
"""The command that installs what serves: the extra `foxglove`, and good for a clone as well."""
LOOPBACK: Final = "127.0.0.1"
PORT: Final = 8765
"""Where Foxglove looks for a server, if it is not told otherwise."""
BACKLOG: Final = 8192
"""Entries that wait for a viewer that is slow; of more, it misses the oldest."""
STOP_SERVICE: Final = "/hil/stop"
"""Name of the service that stops the robots."""
_EMPTY: Final = b'{"type": "object", "properties": {}}'
_ANSWER: Final = b"""{"type": "object", "properties": {
 "confirmed": {"type": "boolean"}, "robots": {"type": "integer"}, "missing": {"type": "integer"}}}"""


class ViewerError(HilError):
    """A viewer can't be served; the text says why, and what to do."""


def check_installed() -> None:
    """See that there is what serves.

    Raises:
        ViewerError: There is not.
    """
    if find_spec("foxglove") is None:
        raise ViewerError(f"Foxglove is served by foxglove-sdk, which is not installed: {INSTALL}")


def open_server(
    name: str,
    context: Context,
    *,
    port: int,
    listener: ServerListener | None = None,
    capabilities: Sequence[Capability] = (),
    services: Sequence[Service] = (),
    playback: tuple[int, int] | None = None,
) -> WebSocketServer:
    """Listen for viewers.

    Args:
        name: What they show it as.
        context: Whose channels they are told of.
        port: TCP port; 0: any that is free.
        listener: Is told what they ask for.
        capabilities: What they may ask for, besides channels.
        services: What they may call.
        playback: Log time of the first and the last entry, in ns, of what can be played; None: it happens now.

    Raises:
        ViewerError: The port can't be listened on.
    """
    from foxglove import start_server  # noqa: PLC0415 - an extra

    try:
        return start_server(
            name=name,
            host=LOOPBACK,
            port=port,
            context=context,
            server_listener=listener,
            capabilities=list(capabilities),
            supported_encodings=["json"] if services else None,
            services=list(services),
            playback_time_range=playback,
            message_backlog_size=BACKLOG,
        )
    except (RuntimeError, OverflowError) as error:
        why = str(error).removeprefix("FoxgloveError: ")
        raise ViewerError(f"no viewer can be served at port {port}: {why}. Choose another; 0 is any that is free") from error


def open_channel(context: Context, topic: str, encoding: str, schema: tuple[str, str, bytes] | None) -> Channel:
    """A channel that viewers are told of.

    Args:
        context: To which it belongs.
        topic: Its topic.
        encoding: How its entries are encoded.
        schema: What they look like: its name, how it is written, and itself; None: nobody knows.
    """
    from foxglove import Channel, Schema  # noqa: PLC0415 - an extra

    described = None if schema is None else Schema(name=schema[0], encoding=schema[1], data=schema[2])
    return Channel(topic, message_encoding=encoding, schema=described, context=context)


def stop_service(act: Callable[[], dict[str, Any]]) -> Service:
    """The service that stops the robots. There is none that lets them go on.

    Args:
        act: Asks for the stop, and says what came of it, such as JSON can hold.
    """
    from foxglove import MessageSchema, Schema, Service, ServiceSchema  # noqa: PLC0415 - an extra

    def form(name: str, schema: bytes) -> MessageSchema:
        return MessageSchema(encoding="json", schema=Schema(name=name, encoding="jsonschema", data=schema))

    return Service(
        STOP_SERVICE,
        schema=ServiceSchema("hil.Stop", request=form("hil.StopRequest", _EMPTY), response=form("hil.StopAnswer", _ANSWER)),
        handler=lambda _: json.dumps(act()).encode(),
    )
