"""Whatever guests of a shared link and robots say: nothing raises, every answer can be said, and robots are only stopped."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any, Final

from guest import ROVER
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_protocol.messages import Command, CommandLong, ParamRequestList, ParamRequestRead, ParamSet
from firmware_protocol.wire.mavlink import MavlinkCodec
from firmware_protocol.wire.payload import PAYLOADS, BadValueError
from hil.bridge.operator import GUEST_STOP, PARAMETERS
from hil.sharing.desk import Asker, FrontDesk

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message

ASKING: Final = (CommandLong, ParamRequestList, ParamRequestRead, ParamSet)
COMMANDS: Final = [*(command.value for command in Command), 519]


def _unpacked(number: int, data: bytes) -> Message | None:
    payload = PAYLOADS[number]
    try:
        return payload.unpack(data.ljust(payload.length, b"\0")[: payload.length])
    except BadValueError:
        return None


def payloads() -> st.SearchStrategy[Message]:
    """Messages as a wire brings them, whatever is in them."""
    numbers = st.sampled_from([*PAYLOADS, *[kind.ID for kind in ASKING] * 5])
    made = st.builds(_unpacked, numbers, st.binary(max_size=64))
    return made.filter(lambda message: message is not None)  # type: ignore[return-value]


def commands() -> st.SearchStrategy[Message]:
    """Commands that mean something, with any numbers."""
    numbers = st.one_of(st.floats(width=32), st.sampled_from([0.0, 1.0, *map(float, PAYLOADS)]))
    return st.builds(CommandLong, st.integers(0, 3), st.integers(0, 2), st.sampled_from(COMMANDS), st.just(0), numbers)


said = st.tuples(st.sampled_from(["guest", "robot", "time"]), st.integers(1, 3), payloads() | commands())


def is_stop(message: Any) -> bool:  # noqa: ANN401 - any message
    return isinstance(message, CommandLong) and message.command == Command.FLIGHT_TERMINATION and message.param1 == 1.0


@settings(deadline=None, max_examples=300, derandomize=True)
@given(st.lists(said, max_size=30))
def test_every_answer_can_be_said_and_nothing_but_the_stop_is_passed_on(course: list[tuple[str, int, Message]]) -> None:
    asked: list[tuple[str, str]] = []
    desk = FrontDesk(lambda what, robot: asked.append((what, robot)))
    desk.heard(ROVER, 1, 1)
    now, stops = 0.0, 0
    for who, number, message in course:
        now += 0.3
        if who == "guest":
            stops += is_stop(message)
            replies = desk.answer(Asker(number, 255, number), message, now)
            assert all(reply.guest == number for reply in replies)
        else:
            replies = desk.heard(message, number, 1) if who == "robot" else desk.overdue(now)
        for reply in replies:
            assert MavlinkCodec(system=reply.system, component=1).encode(reply.message)
    assert sum(what == GUEST_STOP for what, _ in asked) <= stops
    assert {what for what, _ in asked} <= {GUEST_STOP, PARAMETERS}


def test_random_bytes_do_make_commands() -> None:
    data = struct.pack("<7fHBBB", 1.0, 0, 0, 0, 0, 0, 0, 185, 1, 1, 0)
    message = _unpacked(CommandLong.ID, data)
    assert is_stop(message)
