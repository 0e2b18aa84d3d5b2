"""What one can ask of the referee beside an emulated Junior. Each returns a ticket at once; the answer comes with time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.messages import REFEREE_COMPONENT, OpponentCode, RefereeReset
from firmware_protocol.peer.exchanges.commands import NumberedExchange
from firmware_protocol.roles.junior import JUNIOR

if TYPE_CHECKING:
    from firmware_protocol.messages import RobotAck
    from firmware_protocol.peer.exchanges.exchange import Ticket
    from firmware_protocol.peer.peer import Peer


def reset_bout(peer: Peer, seed: int, opponent: OpponentCode = OpponentCode.KEEP) -> Ticket[RobotAck]:
    """Have the referee begin a new bout.

    Args:
        peer: The robot beside which the referee is.
        seed: Start poses are drawn from it, 0..2^32 - 1.
        opponent: Who plays against Junior.
    """
    message = RefereeReset(seed, 0, 0, peer.system, REFEREE_COMPONENT, opponent)
    return peer.ask(NumberedExchange("a new bout", message, peer.numbering), JUNIOR)
