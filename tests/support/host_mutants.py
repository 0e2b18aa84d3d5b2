"""Deliberately broken firmwares, broken in whom they obey, who keeps them and whom they answer; see `mutants`."""

from __future__ import annotations

import dataclasses
from typing import Final

from mutants import Mutant

from firmware_protocol.wire.fields import CAN
from hil.conformance import CHECKS

NEED_SOURCES: Final = {
    *(check.name for check in CHECKS if check.group == "answers"),
    "result-addressed",
    "memory-entry-addressed",
    "streams-set-again",
    "ground-station-not-kept-by-others",
    "manual-control-from-who-armed",
    "anybody-stops",
}
"""What can be seen only where a frame says who sent it."""

_KEEPERS: Final = (
    Mutant(
        "heartbeats-do-not-keep",
        "is kept by any frame of who armed it, though that is a host that names itself",
        "keeper.c",
        "if (robot->keeper.by == KEEPER_SENDER && keeper_is(robot, from)) {",
        "if (keeper_is(robot, from)) {",
    ),
    Mutant(
        "alive-keeps",
        "hears ROBOT_ALIVE only where it is said to all",
        "protocol.c",
        "        keeper_alive(robot, message->alive.host);",
        "        if (!direct) {\n            keeper_alive(robot, message->alive.host);\n        }",
    ),
    Mutant(
        "alive-of-other-host-ignored",
        "does not look whose ROBOT_ALIVE it is",
        "keeper.c",
        "if (host == robot->session.host) {",
        "if (host != 0) {",
    ),
    Mutant(
        "numbered-messages-keep",
        "does not know that who gives orders is alive",
        "numbered.c",
        "    session->owner = from;\n    keeper_numbered(robot);",
        "    session->owner = from;",
    ),
    Mutant(
        "other-session-does-not-keep",
        "is kept by what it refuses",
        "numbered.c",
        "        acknowledge(robot, from, id, session_id, sequence, ROBOT_REASON_WRONG_SESSION);",
        "        keeper_numbered(robot);\n"
        "        acknowledge(robot, from, id, session_id, sequence, ROBOT_REASON_WRONG_SESSION);",
    ),
    Mutant(
        "other-host-cannot-arm",
        "lets itself be armed by any host, whoever's session it is",
        "command.c",
        "(!robot->session.open || number < host || number > host)",
        "!robot->session.open",
    ),
    Mutant(
        "other-host-cannot-arm",
        "takes half a number for none",
        "command.c",
        "bool named = number > 0.0f;",
        "bool named = number >= 1.0f;",
    ),
    Mutant(
        "manual-control-not-for-host",
        "lets whoever shares its host's address drive",
        "protocol.c",
        "if (robot->keeper.by != KEEPER_SENDER || !keeper_is(robot, from) ||",
        "if (!keeper_is(robot, from) ||",
    ),
    Mutant(
        "manual-control-dead-man",
        "holds the stick for a second",
        "protocol.c",
        "MANUAL_MS = 250",
        "MANUAL_MS = 1000",
    ),
    Mutant(
        "stick-range",
        "takes a stick as far forward as it says",
        "protocol.c",
        "return *value >= -1000 && *value <= 1000;",
        "return *value >= -1000;",
    ),
    Mutant(
        "ground-station-obeyed",
        "listens to nobody else once a host has come",
        "command.c",
        "(!robot->session.open || number < host || number > host)",
        "(!robot->session.open || number < host || number > host)) || (!named && robot->session.open",
    ),
    Mutant(
        "ground-station-obeyed",
        "takes NaN for a host's number",
        "command.c",
        "bool named = number > 0.0f;",
        "bool named = number != 0.0f;",
    ),
    Mutant(
        "ground-station-closes-session",
        "goes on with its session when somebody else has armed it",
        "keeper.c",
        "        numbered_close(robot);",
        "        ;",
    ),
    Mutant(
        "ground-station-closes-session",
        "lets the host of a closed session arm it",
        "command.c",
        "(!robot->session.open || number < host || number > host)",
        "(number < host || number > host)",
    ),
    Mutant(
        "new-keeper-stops-motion",
        "goes on with what another has set in motion",
        "keeper.c",
        "        states_fire(robot, EVENT_RELEASE, ROBOT_REASON_BY_COMMAND);",
        "        ;",
    ),
    Mutant(
        "ground-station-keeps",
        "is kept by hosts that name themselves, and by nobody else",
        "keeper.c",
        "if (robot->keeper.by == KEEPER_SENDER && keeper_is(robot, from)) {",
        "if (false && keeper_is(robot, from)) {",
    ),
    Mutant(
        "stopped-state-said-at-once",
        "says in HEARTBEAT what it was doing a control period ago",
        "stream.c",
        "        if ((due || requested) && send_one(robot, i)) {",
        "        static uint8_t before;\n        uint8_t now = robot->state;\n        bool sent;\n\n"
        "        robot->state = i == STREAM_HEARTBEAT ? before : now;\n"
        "        sent = (due || requested) && send_one(robot, i);\n"
        "        robot->state = now;\n        before = now;\n        if (sent) {",
    ),
    Mutant(
        "host-without-number-refused",
        "opens a session for a host that nobody can tell from others",
        "numbered.c",
        "request->major != PROTOCOL_MAJOR || request->host == 0",
        "request->major != PROTOCOL_MAJOR",
    ),
    Mutant(
        "heartbeat-stays",
        "lets its heartbeat be made as rare as anything else",
        "stream.c",
        "#define LONGEST_HEARTBEAT_MS 5000L",
        "#define LONGEST_HEARTBEAT_MS LONGEST_MS",
    ),
    Mutant(
        "heartbeat-stays",
        "lets its heartbeat be switched off",
        "stream.c",
        "(interval < 0 || interval > LONGEST_HEARTBEAT_MS * 1000)",
        "interval > LONGEST_HEARTBEAT_MS * 1000",
    ),
)
"""Each on both wires."""

_SENDERS: Final = (
    Mutant(
        "heartbeats-do-not-keep",
        "is kept going by anybody",
        "keeper.c",
        "if (robot->keeper.by == KEEPER_SENDER && keeper_is(robot, from)) {",
        "if (robot->keeper.by == KEEPER_SESSION || keeper_is(robot, from)) {",
    ),
    Mutant(
        "ground-station-not-kept-by-others",
        "takes every program of a system for who armed it",
        "keeper.c",
        "if (robot->keeper.by == KEEPER_SENDER && keeper_is(robot, from)) {",
        "if (robot->keeper.by == KEEPER_SENDER && robot->keeper.sender.system == from.system) {",
    ),
    Mutant(
        "ground-station-not-kept-by-others",
        "is still kept by the host whose session is closed",
        "keeper.c",
        "        keeper_numbered(robot);\n    }\n}",
        "        heard(robot);\n    }\n}",
    ),
    Mutant(
        "manual-control-from-who-armed",
        "lets every program of a system drive what one of them has armed",
        "protocol.c",
        "|| !keeper_is(robot, from) || !stick(&forward)",
        "|| robot->keeper.sender.system != from.system || !stick(&forward)",
    ),
    Mutant(
        "anybody-stops",
        "lets itself be disarmed by its keeper alone",
        "command.c",
        "        states_fire(robot, EVENT_DISARM, ROBOT_REASON_DISARMED);\n        return MAV_RESULT_ACCEPTED;",
        "        if (robot->keeper.by != KEEPER_NONE && !keeper_is(robot, from)) {\n"
        "            return MAV_RESULT_DENIED;\n        }\n"
        "        states_fire(robot, EVENT_DISARM, ROBOT_REASON_DISARMED);\n        return MAV_RESULT_ACCEPTED;",
    ),
    Mutant(
        "streams-set-again",
        "does not like it when another program sets a stream",
        "command.c",
        "        result = set_interval(robot, command->param1, command->param2);",
        "        static uint8_t last = 255;\n        bool same = last == from.system;\n\n        last = from.system;\n"
        "        result = (uint8_t)(same ? set_interval(robot, command->param1, command->param2) : MAV_RESULT_DENIED);",
    ),
)
"""Each on MAVLink alone: a bus has no source."""


def _unanswered(caught_by: str, source: str, before: str, field: str) -> Mutant:
    """One that does not fill in whom it answers."""
    return Mutant(caught_by, "does not say whom it answers", source, before, before.replace(field, "0"))


_ANSWERS: Final = (
    _unanswered("command-ack-addressed", "command.c", "ack.target_system = from.system;", "from.system"),
    Mutant(
        "command-ack-addressed",
        "answers whatever program of a system",
        "command.c",
        "ack.target_component = from.component;",
        "ack.target_component = MAV_COMP_ID_MISSIONPLANNER;",
    ),
    _unanswered(
        "timesync-addressed",
        "protocol.c",
        "answer.ts1 = question->ts1;\n    answer.target_system = from.system;",
        "from.system",
    ),
    _unanswered(
        "ping-addressed",
        "protocol.c",
        "answer.target_component = from.component;\n    SEND(robot, PING, &answer);",
        "from.component",
    ),
    _unanswered(
        "mission-count-addressed",
        "protocol.c",
        "answer.target_component = from.component;\n    answer.mission_type = mission_type;",
        "from.component",
    ),
    _unanswered("ack-addressed", "numbered.c", "ack.target_system = to.system;", "to.system"),
    Mutant(
        "ack-addressed",
        "answers who opened the session, whoever asks in it",
        "numbered.c",
        "    session->owner = from;\n    keeper_numbered(robot);",
        "    keeper_numbered(robot);",
    ),
    _unanswered(
        "result-addressed",
        "maneuver.c",
        "maneuver->result.target_system = junior->robot.session.owner.system;",
        "junior->robot.session.owner.system",
    ),
    _unanswered(
        "memory-entry-addressed",
        "memory.c",
        "entry.target_system = junior->robot.session.owner.system;",
        "junior->robot.session.owner.system",
    ),
)
"""Each on MAVLink alone: on a bus answers name nobody."""

_FRAMES: Final = (
    Mutant(
        "alive-frame-exact",
        "reads more of a ROBOT_ALIVE than there is, and less",
        "can.c",
        "if (frame->length != sizeof alive->host) {",
        "if (frame->length == 0) {",
        CAN,
    ),
    Mutant(
        "alive-keeps",
        "takes a ROBOT_ALIVE to all alone",
        "can.c",
        "    case CAN_FUNCTION_ALIVE:\n        return take_alive(robot, frame, node, message);",
        "    case CAN_FUNCTION_ALIVE:\n        return take_alive(robot, frame, node, message) && node == 0;",
        CAN,
    ),
    Mutant(
        "ground-station-keeps",
        "hears no ground station on a bus",
        "can.c",
        "        keeper_frame(robot, from);\n",
        "",
        CAN,
    ),
)
"""Each in what it makes of CAN frames."""

HOST_MUTANTS: Final = (
    *_KEEPERS,
    *_SENDERS,
    *_ANSWERS,
    *(dataclasses.replace(mutant, wire=CAN) for mutant in _KEEPERS),
    *_FRAMES,
)
"""Each fails the one check that names its fault."""
