"""How a robot gets its signing key, and loses it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.events import RejectReason
from firmware_protocol.wire.signing import setup_signing
from hil.signing.key_file import calendar

if TYPE_CHECKING:
    from firmware_protocol.wire.signing import SigningKey
    from hil.connecting.handle import RobotHandle

TRIES: Final = 3
"""How often the key is sent: nothing answers it."""
STORE_TIME: Final = 0.5
"""A robot may take so long to store a key, in s: an EEPROM takes 3.4 ms a byte, and there are two copies."""


def give_key(robot: RobotHandle, key: SigningKey | None) -> None:
    """Give a robot a key, or take it away.

    MAVLink has no answer to this. From what the robot says afterwards it is seen that something has changed; to be sure,
    connect anew with the new key.

    Args:
        robot: The robot, connected with the key that it has now.
        key: The key; None takes it away.

    Raises:
        LinkError: The link is gone.
    """
    bridge = robot.bridge

    def changed() -> tuple[int, ...]:
        refused = bridge.rejected[RejectReason.BAD_SIGNATURE] + bridge.rejected[RejectReason.NOT_SIGNED]
        return (refused, bridge.signed if bridge.signing is None else 0)

    before = changed()
    for _ in range(TRIES):
        bridge.send(setup_signing(robot.peer.system, key, calendar() if key else 0))
        deadline = robot.now() + STORE_TIME
        while robot.now() < deadline:
            robot.step(min(0.05, deadline - robot.now()))
            if changed() != before:
                return
