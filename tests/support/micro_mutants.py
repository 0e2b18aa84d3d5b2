"""Deliberately broken firmwares of a micro-robot: each breaks one of its own rules; see `mutants`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from mutants import Mutant

from firmware_protocol.wire.fields import CAN


@dataclass(frozen=True)
class MicroMutant(Mutant):
    """One broken firmware of a micro-robot.

    Attributes:
        fixes: It finds its position itself.
    """

    fixes: bool = True


_OBSERVATIONS: Final = (
    MicroMutant(
        "observation-repeated",
        "repeats an observation every 250 ms",
        "observation.c",
        "all->interval = (uint16_t)(all->interval < LAST_MS ? 2U * all->interval : LAST_MS);",
        "all->interval = FIRST_MS;",
    ),
    MicroMutant(
        "observation-acknowledged",
        "takes any acknowledgement of its session for that of its observation",
        "micro.c",
        " && sequence == micro_of(robot)->observations.ended.sequence) {",
        ") {\n        (void)sequence;",
    ),
    MicroMutant(
        "observation-superseded",
        "repeats an observation though there is news",
        "observation.c",
        "        observation_send_now(micro);\n    }\n    move_drop(micro);",
        "        observation_send_now(micro);\n    }",
    ),
    MicroMutant(
        "observation-on-request",
        "names no session in what is asked for",
        "observation.c",
        "    observe(micro, &told, sequence, true);\n",
        "    observe(micro, &told, sequence, true);\n    told.session = 0;\n",
    ),
    MicroMutant(
        "observation-on-request-of-all",
        "acknowledges what all are asked for",
        "command.c",
        "        if (ROLE_OF(robot, stream_asked) && !direct) {",
        "        if (false) {",
    ),
    MicroMutant(
        "observation-requests-kept-apart",
        "knows one asker only",
        "observation.c",
        "uint8_t asker = held ? ASKER_HOLDER : ASKER_WATCHER;",
        "uint8_t asker = (uint8_t)(held ? ASKER_HOLDER : ASKER_WATCHER);\n\n"
        "    micro->observations.asked[stream][!asker].pending = false;",
    ),
    MicroMutant(
        "sense-option-reads-ring",
        "says that the ring was read for every move",
        "move.c",
        "        observation_end(micro, senses(&micro->move));",
        "        observation_end(micro, true);",
    ),
    MicroMutant(
        "ranges-measured",
        "sends no ranges with a move",
        "observation.c",
        "    return ring_fitted(micro) && (micro->move.options & SWARM_MOVE_OPTION_RANGES) != 0;",
        "    return micro == 0;",
    ),
    MicroMutant(
        "watcher-moves-nothing",
        "takes everybody for the session's holder",
        "observation.c",
        "    if (asker == ASKER_HOLDER) {",
        "    if (asker != ASKERS) {",
    ),
    MicroMutant(
        "move-that-sensed-moves-before",
        "forgets the radius that a move's observation has used",
        "observation.c",
        "    remember(micro, &all->ended);\n",
        "",
    ),
    MicroMutant(
        "sense-kept-until-reboot",
        "forgets SWARM_SENSE with its session",
        "micro.c",
        "    micro_of(robot)->move.reported = false;\n    move_drop(micro_of(robot));",
        "    micro_of(robot)->move.reported = false;\n    micro_of(robot)->ring.told = false;\n    move_drop(micro_of(robot));",
    ),
)
_DRIVES: Final = (
    MicroMutant(
        "move-arrives",
        "drives half of its way",
        "move.c",
        "    move->distance = (int32_t)request->distance * UM_PER_MM;",
        "    move->distance = (int32_t)request->distance * UM_PER_MM / 2;",
    ),
    MicroMutant(
        "move-in-arena-frame",
        "counts every heading from its nose",
        "move.c",
        "        if (!(request->options & SWARM_MOVE_OPTION_BODY)) {\n            return way;\n        }\n",
        "",
    ),
    MicroMutant(
        "move-from-nose",
        "counts the heading of a drive in the arena's frame",
        "move.c",
        "        if (!(request->options & SWARM_MOVE_OPTION_BODY)) {",
        "        if (!(request->options & SWARM_MOVE_OPTION_BODY) || request->distance != 0) {",
    ),
    MicroMutant(
        "move-along-sector",
        "drives along the edge of a sector",
        "move.c",
        "(2UL * request->sector - 1UL)",
        "(2UL * request->sector)",
    ),
    MicroMutant(
        "move-turns-to-face",
        "counts `face` from its nose",
        "move.c",
        "    move->face = angles_from_wire(request->face);",
        "    move->face = (uint16_t)(angles_from_wire(request->face) + pose_heading(micro));",
    ),
    MicroMutant(
        "move-backward",
        "turns its nose to the way and drives on, though it is to go backward",
        "move.c",
        "set_wheels(micro, move->options & SWARM_MOVE_OPTION_BACKWARD ? -speed : speed,",
        "set_wheels(micro, speed,",
    ),
    MicroMutant(
        "move-turns-only",
        "drives on a little where it was told to turn",
        "move.c",
        "    move->distance = (int32_t)request->distance * UM_PER_MM;",
        "    move->distance = (int32_t)(request->options == 0 && request->distance == 0 ? 40 : request->distance) * UM_PER_MM;",
    ),
    MicroMutant(
        "move-speed",
        "knows its own speed only",
        "move.c",
        "request->speed == 0 ? micro_milli(micro, MICRO_PARAM_MOVE_SPEED) : request->speed;",
        "micro_milli(micro, MICRO_PARAM_MOVE_SPEED);",
    ),
    MicroMutant(
        "repeated-move-moves-once",
        "drives its way again when a move comes again",
        "move.c",
        "    fire(micro, ON_REPEAT);\n",
        "    if (micro->move.distance != 0) {\n"
        "        states_fire(&micro->robot, EVENT_PERFORM, ROBOT_REASON_BY_COMMAND);\n"
        "        micro->move.deadline = micro->robot.time.now + 2000U;\n"
        "        fire(micro, ON_BEGIN);\n        return;\n    }\n"
        "    fire(micro, ON_REPEAT);\n",
    ),
    MicroMutant(
        "move-frame-taken",
        "knows eight sectors only where a move is a single frame",
        "move_frame.c",
        "move->sectors = ring_setting(micro_of(robot))->sectors;",
        "move->sectors = 8;",
        CAN,
    ),
)
_REFUSALS: Final = (
    MicroMutant(
        "move-range",
        "takes a distance that is too great",
        "move.c",
        "return request->distance <= DISTANCE_MOST && request->sectors",
        "return request->sectors",
    ),
    MicroMutant(
        "move-needs-a-way",
        "takes no way at all for its nose's where there is a distance",
        "move.c",
        "(request->heading != ANGLE_NONE || request->sector != 0)",
        "(request->heading != ANGLE_NONE || request->sector != 0 || request->distance != 0)",
    ),
    MicroMutant(
        "sense-range",
        "takes more sectors than a mask has bits for",
        "ring.c",
        " || request->sectors > SECTORS_MOST ||",
        " ||",
    ),
    MicroMutant(
        "fence-refuses-moves-out",
        "begins moves that lead beyond the fence",
        "move.c",
        "        if (fence_leaves(micro, way, request->distance)) {",
        "        if (false) {",
    ),
    MicroMutant(
        "fence-lets-back-in",
        "refuses every move that ends outside",
        "fence.c",
        "return there > 0 && there >= outside(micro, micro->pose.x, micro->pose.y);",
        "return there > 0;",
    ),
    MicroMutant(
        "fence-stops-outward",
        "drives on when it is beyond the fence",
        "move.c",
        "} else if (fence_there(micro) && fence_crossed(micro, move->way, heading)) {",
        "} else if (false) {",
    ),
    MicroMutant(
        "fence-needs-fix",
        "goes on without a fix inside a fence",
        "move.c",
        "} else if (fence_there(micro) && !pose_known(micro)) {",
        "} else if (false) {",
    ),
    MicroMutant(
        "dead-reckoning-told",
        "does not say that its fix is too old",
        "observation.c",
        "    if (!pose_known(micro)) {",
        "    if (!micro->pose.fixed) {",
    ),
    MicroMutant(
        "own-fix-believed",
        "believes SWARM_FIX though it finds its position itself",
        "micro.c",
        " && !hal_has_pose(robot->board)\n",
        "\n",
    ),
    MicroMutant(
        "fix-believed",
        "does not hear SWARM_FIX",
        "micro.c",
        "    if (id != MAVLINK_MSG_ID_SWARM_FIX) {\n        return false;\n    }\n",
        "    if (id != MAVLINK_MSG_ID_SWARM_FIX) {\n        return false;\n    }\n    return true;\n",
        fixes=False,
    ),
    MicroMutant(
        "fix-of-other-session-ignored",
        "believes SWARM_FIX of any session",
        "micro.c",
        "told->session == robot->session.id && ",
        "",
        fixes=False,
    ),
    MicroMutant(
        "old-fix-ignored",
        "believes SWARM_FIX however old it is",
        "micro.c",
        "\n        && told->age < micro_milli(micro_of(robot), MICRO_PARAM_FIX_AGE)",
        "",
        fixes=False,
    ),
)
_ENDINGS: Final = (
    MicroMutant("move-times-out", "tries for two seconds more", "move.c", "SPARE_MS = 1000", "SPARE_MS = 3000"),
    MicroMutant(
        "pushing-move-has-longer",
        "gives pushing no more time",
        "move.c",
        "(move->options & SWARM_MOVE_OPTION_PUSH ? 3U : 2U)",
        "2U",
    ),
    MicroMutant(
        "move-replaced",
        "says that a move which was replaced was stopped",
        "move.c",
        "            move->outcome = SWARM_OUTCOME_REPLACED;",
        "            move->outcome = SWARM_OUTCOME_STOPPED;",
    ),
    MicroMutant(
        "stopped-move-stands",
        "leaves its wheels as they are when a move has been stopped",
        "move.c",
        "    hal_force(micro->robot.board, under_way(move)",
        "    if (move->outcome == SWARM_OUTCOME_STOPPED && micro->robot.state != ROBOT_STATE_PERFORMING\n"
        "        && move->distance != 0) {\n"
        "        set_wheels(micro, 50000, 0);\n    }\n"
        "    hal_force(micro->robot.board, under_way(move)",
    ),
    MicroMutant(
        "move-blocked-by-contact",
        "does not feel what it drives into",
        "move.c",
        "&& (move_contact_ahead(micro) || stalls(micro))) {",
        "&& stalls(micro)) {",
    ),
    MicroMutant(
        "contact-behind-lets-drive",
        "is blocked by contact on any side",
        "move.c",
        "&& (move_contact_ahead(micro) || stalls(micro))) {",
        "&& (micro->bumps != 0 || stalls(micro))) {",
    ),
    MicroMutant(
        "unasked-contact-ignored",
        "is blocked by contact though it is to push",
        "move.c",
        "(move->options & (SWARM_MOVE_OPTION_STOP_ON_CONTACT | SWARM_MOVE_OPTION_PUSH)) == SWARM_MOVE_OPTION_STOP_ON_CONTACT",
        "(move->options & SWARM_MOVE_OPTION_STOP_ON_CONTACT) != 0",
    ),
)
_NEIGHBOURS: Final = (
    MicroMutant(
        "neighbour-in-its-sector",
        "has the bits of its sectors the other way round",
        "ring.c",
        "setting->sectors - 1U - ((uint32_t)other.bearing * setting->sectors >> 16)",
        "(uint32_t)other.bearing * setting->sectors >> 16",
    ),
    MicroMutant(
        "radius-grows",
        "grows beyond its limit",
        "ring.c",
        "        steps = steps > most ? most : steps;\n",
        "        (void)most;\n",
    ),
    MicroMutant(
        "radius-ignores-own-class",
        "looks for anybody, not for the other class",
        "ring.c",
        "if (other.group != group && other.distance < nearest) {",
        "if (other.distance < nearest) {",
    ),
    MicroMutant(
        "long-range-sees-all",
        "sees nobody at long range",
        "ring.c",
        "return radius == LENGTH_NONE || distance",
        "return radius != LENGTH_NONE && distance",
    ),
    MicroMutant(
        "counts-before-and-after",
        "counts within the radius of now for both",
        "ring.c",
        "        if (inside(other.distance, reading->radius_before)) {",
        "        if (inside(other.distance, reading->radius)) {",
    ),
)
MICRO_MUTANTS: Final = (*_OBSERVATIONS, *_DRIVES, *_REFUSALS, *_ENDINGS, *_NEIGHBOURS)
