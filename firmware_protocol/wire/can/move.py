"""SWARM_MOVE as a single CAN frame: what a plain move needs has room in eight bytes; the rest is known, or goes as a transfer.

Left out are the session (the one that is open), `face` (none), `speed` and `effort` (0), and `sectors`: with a sector given,
what SWARM_SENSE said last within the session, else 0.
"""

from __future__ import annotations

from typing import Final

from firmware_protocol.messages import ROBOT_COMPONENT, SwarmMove
from firmware_protocol.wire.mavlink_layout import offsets

_AT: Final = offsets(SwarmMove)
_HEAD: Final = slice(_AT["sequence"], _AT["face"])
NO_FACE: Final = -32768
"""Wire value of `face` where there is none."""
_NO_FACE: Final = NO_FACE.to_bytes(2, "little", signed=True)
_PLAIN: Final = _NO_FACE + bytes(2)
"""`face` and `speed` of a move that fits."""


def frame_of_move(full: bytes, sectors: int) -> bytes | None:
    """The data of the single frame.

    Args:
        full: The untrimmed payload of SWARM_MOVE.
        sectors: What SWARM_SENSE has told the robot within the session; 0: nothing.

    Returns:
        Eight bytes; None where the move does not fit.
    """
    sector = full[_AT["sector"]]
    told = sectors if sector else 0
    if sector and not sectors:
        return None
    if full[_AT["face"] : _AT["target_system"]] != _PLAIN or full[_AT["sectors"]] != told or full[_AT["effort"]]:
        return None
    return full[_HEAD] + bytes((sector, full[_AT["options"]]))


def move_of_frame(data: bytes, session: int, sectors: int, node: int) -> bytes:
    """The payload of SWARM_MOVE.

    Args:
        data: Of the single frame, eight bytes.
        session: The one that is open with the robot.
        sectors: What SWARM_SENSE has told the robot within the session; 0: nothing.
        node: For whom it is.
    """
    head, sector, options = data[:-2], data[-2], data[-1]
    rest = bytes((node, ROBOT_COMPONENT, sector, sectors if sector else 0, 0, options))
    return session.to_bytes(2, "little") + head + _PLAIN + rest
