"""What kind of robot it is: said by itself, known by a table, and asked for by every verb of a role."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from peer_bench import Bench, failed

import firmware_protocol
from firmware_protocol.messages import (
    MESSAGES,
    ROBOT_COMPONENT,
    Command,
    CommandLong,
    ContestCommand,
    JuniorManeuverResult,
    JuniorMemoryEntry,
    JuniorSensors,
    RobotResultAck,
    RobotStatus,
    State,
    SysStatus,
)
from firmware_protocol.peer.role import Role
from firmware_protocol.roles.junior import JUNIOR, contest, drive, erase_memory, perform, read_memory, write_memory
from firmware_protocol.roles.known import ROLES, SIGNS
from firmware_protocol.roles.referee import reset_bout
from firmware_protocol.vocabulary import Action, Maneuver
from firmware_protocol.wire.fields import Party

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.peer.exchanges.exchange import Ticket
    from firmware_protocol.peer.peer import Peer

MOLE = Role(
    name="mole",
    product=7,
    readings=SysStatus,
    streams={SysStatus: 0.5},
    slowest=2.0,
    results=frozenset({JuniorMemoryEntry}),
    undisturbed=frozenset({State.DRIVING}),
)
"""A role that there is not."""
STEP = Maneuver((Action.F,))


def met(product: int, state: State = State.READY) -> Bench:
    """A robot that has said what it is, and has opened a session."""
    bench = Bench(roles=(JUNIOR, MOLE))
    bench.heartbeat(state=state)
    bench.version(product=product)
    bench.ack()
    return bench


@pytest.mark.parametrize(("product", "role"), [(0, JUNIOR), (7, MOLE)])
def test_a_robot_is_what_it_says(product: int, role: Role) -> None:
    assert met(product).peer.role is role


def test_one_that_nobody_knows_is_taken_for_no_other() -> None:
    other = met(99)
    assert other.peer.role not in (JUNIOR, MOLE)
    assert "product 99" in failed(perform(other.peer, STEP))


def test_it_is_asked_for_the_streams_of_its_role() -> None:
    for product, streams in ((0, JUNIOR.streams), (7, MOLE.streams)):
        bench = met(product)
        assert bench.peer.streams.intervals == streams
        for _ in streams:  # one after the other
            bench.command_ack(Command.SET_MESSAGE_INTERVAL)
            bench.wait(0.005)
        asked = [message for message in bench.sent if isinstance(message, CommandLong)]
        intervals = {int(one.param1) for one in asked if one.command == Command.SET_MESSAGE_INTERVAL}
        assert intervals == {message.ID for message in streams}


@pytest.mark.parametrize(
    "verb",
    [
        lambda peer: perform(peer, STEP),
        lambda peer: drive(peer, 0.1, 0.1, 0.1),
        lambda peer: write_memory(peer, 1, 2, STEP),
        erase_memory,
        lambda peer: read_memory(peer, 0),
        lambda peer: contest(peer, ContestCommand.START),
        lambda peer: reset_bout(peer, 1),
    ],
    ids=["perform", "drive", "write", "erase", "read", "contest", "reset"],
)
def test_a_verb_says_which_role_it_needs(verb: Callable[[Peer], Ticket[Any]]) -> None:
    other = met(7)
    other.sent.clear()
    assert failed(verb(other.peer)).endswith("takes a Junior, and robot 1 is a mole")
    assert not [message for message in other.sent if message.NUMBERED]
    assert not verb(met(0).peer).done


def test_results_of_the_role_are_acknowledged_and_those_of_others_are_not() -> None:
    zeros = (0,) * 8
    bench = met(7)
    bench.sent.clear()
    bench.heard(JuniorMemoryEntry(701, 3, 0, 0.0, 0, 255, 190, 0, 0, 0, 0, 0, zeros))
    assert [(ack.sequence, ack.target_component) for ack in bench.take(RobotResultAck)] == [(3, ROBOT_COMPONENT)]
    result = JuniorManeuverResult(
        701, 1, zeros, zeros, zeros, (0.0,) * 8, (0.0,) * 8, (None,) * 8, zeros, zeros, 255, 190, 0, 0, 0, 0, 0
    )
    bench.heard(result)
    assert not bench.take(RobotResultAck)


def test_a_session_leaves_a_robot_armed_in_the_states_of_its_role() -> None:
    assert met(7, State.DRIVING).peer.armed is True
    assert met(7, State.CONTEST).peer.armed is False
    assert met(0, State.CONTEST).peer.armed is True


def test_the_table_names_a_product_once_and_tells_what_gives_a_robot_away() -> None:
    assert len({role.product for role in ROLES}) == len({role.name for role in ROLES}) == len(ROLES)
    assert {RobotStatus, JuniorSensors} <= SIGNS
    for role in ROLES:
        assert role.readings in role.streams
        assert role.streams[role.readings] <= role.slowest


ROOT = Path(firmware_protocol.__file__).parent.parent
GENERAL = [
    *sorted((ROOT / "firmware_protocol/peer").glob("*.py")),
    *sorted((ROOT / "hil/bridge").glob("*.py")),
    *(ROOT / "hil/recording" / name for name in ("wire_log.py", "drawing.py")),
]


@pytest.mark.parametrize("path", GENERAL, ids=lambda path: str(path.relative_to(ROOT)))
def test_what_is_true_of_any_robot_names_no_message_of_a_role(path: Path) -> None:
    """`messages` has those of all roles, so that import-linter can't see it."""
    of_roles = {message.__name__ for message in MESSAGES.values() if message.PARTY is not Party.ROBOT} | {
        "REFEREE_COMPONENT",
        "TABLE_COMPONENT",
    }
    named = {node.id for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Name)}
    imported = {
        alias.name for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.ImportFrom) for alias in node.names
    }
    assert not of_roles & (named | imported)
