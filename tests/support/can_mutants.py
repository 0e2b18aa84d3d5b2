"""Deliberately broken firmwares, broken in what they make of CAN frames; see `mutants`."""

from __future__ import annotations

from typing import Final

from mutants import Mutant

from firmware_protocol.wire.fields import CAN


def _mutant(caught_by: str, fault: str, before: str, after: str) -> Mutant:
    return Mutant(caught_by, fault, "can.c", before, after, CAN)


CAN_MUTANTS: Final = (
    _mutant(
        "all-means-stop-only",
        "takes an emergency stop of its own alone",
        "    case CAN_FUNCTION_ESTOP:\n        return take_stop(robot, frame, node, message);",
        "    case CAN_FUNCTION_ESTOP:\n        return node != 0 && take_stop(robot, frame, node, message);",
    ),
    _mutant(
        "stop-frame-exact",
        "takes anything under the identifier of the emergency stop for one",
        "if (frame->length != 1 || frame->data[0] != 1) {",
        "if (frame->length == 0 || frame->data[0] == 0) {",
    ),
    Mutant(
        "wheels-frame-exact",
        "drives at what a short frame does not say",
        "single_frames.c",
        "if (frame->length != FRAME_DATA) {",
        "if (frame->length == 0) {",
        CAN,
    ),
    _mutant(
        "other-target-ignored",
        "takes frames of other nodes for its own",
        "if (node != 0 && node != own_node(robot)) {",
        "if (false) {",
    ),
    _mutant(
        "foreign-functions-ignored",
        "does not look at the direction of an identifier",
        "switch (frame->identifier >> FUNCTION_SHIFT) {",
        "switch ((frame->identifier >> FUNCTION_SHIFT) & ~1) {",
    ),
    Mutant(
        "node-within-the-bus",
        "lets itself be given a number that no node can have",
        "params.c",
        "return !(robot->can.fitted && index == ROLE_OF(robot, param_sys_id) && value > 127.0f);",
        "return true;",
        CAN,
    ),
    _mutant(
        "partial-transfer-given-up",
        "waits for the rest of a transfer for ever",
        "robot->time.now - transfer->heard > SILENCE_MS",
        "false",
    ),
    _mutant(
        "abandoned-transfer-replaced",
        "begins no transfer while another is under way",
        "    if (part == 0) {\n        if (!begin(",
        "    if (part == 0 && transfer->size == 0) {\n        if (!begin(",
    ),
    _mutant(
        "repeated-part-taken-once",
        "stumbles over a part that comes twice",
        "if (transfer->size > 0 && frame->data[0] == transfer->head && count == transfer->count",
        "if (false && count == transfer->count",
    ),
    _mutant(
        "transfers-interleaved",
        "collects what is for it and what is for all in one place",
        "&robot->can.in[node != 0]",
        "&robot->can.in[0]",
    ),
    _mutant(
        "stop-between-parts",
        "forgets a transfer when something more urgent comes",
        "    message->direct = node != 0;\n",
        "    message->direct = node != 0;\n"
        "    if (frame->identifier >> FUNCTION_SHIFT == CAN_FUNCTION_ESTOP) {\n        robot->can.in[1].size = 0;\n    }\n",
    ),
    _mutant(
        "transfer-checksum-checked",
        "takes transfers whatever their checksum",
        "if (data[HEAD + length] != (uint8_t)crc || data[HEAD + length + 1] != (uint8_t)(crc >> 8)) {",
        "if (false) {",
    ),
    _mutant(
        "part-length-checked",
        "takes parts of any length for full ones",
        "    if (count != (want < PART_DATA ? want : PART_DATA)) {",
        "    count = want < PART_DATA ? want : PART_DATA;\n    if (false) {",
    ),
    _mutant(
        "transfer-length-checked",
        "takes more of a message than there is",
        "frame->data[3] <= flash_u8(&row->length) - flash_u8(&row->cut)",
        "frame->data[3] <= flash_u8(&row->length)",
    ),
    _mutant(
        "shorter-transfer-taken",
        "takes messages at full length alone",
        "frame->data[3] <= flash_u8(&row->length) - flash_u8(&row->cut)",
        "frame->data[3] == flash_u8(&row->length) - flash_u8(&row->cut)",
    ),
    _mutant(
        "unknown-transfer-counted",
        "does not count messages that it does not know",
        "    robot->counters.unknown++;\n    if (transfer->known &&",
        "    robot->counters.unknown += row != NULL || frame->length <= HEAD;\n    if (transfer->known &&",
    ),
    _mutant(
        "upward-message-refused",
        "listens to what robots say",
        "if (row != NULL && flash_u8(&row->inbound)\n",
        "if (row != NULL\n",
    ),
    _mutant(
        "good-transfers-counted",
        "counts what begins a maneuver, and not what turns the wheels",
        "        robot->counters.good++;",
        "        robot->counters.good += message.id != MAVLINK_MSG_ID_JUNIOR_WHEELS;",
    ),
    _mutant(
        "lost-transfers-counted",
        "miscounts where the numbers of the transfers wrap",
        "(uint8_t)(transfer->number - transfer->next) % TRANSFERS;",
        "(uint8_t)((transfer->number - transfer->next) % TRANSFERS);",
    ),
)
"""Each fails the one check that names its fault, over CAN."""
