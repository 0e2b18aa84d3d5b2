/* What a micro-robot brings to the core. */
#include "micro/modules.h"

const struct inbound_row micro_inbound[] HAL_FLASH = {ROLE_INBOUND_TABLE MICRO_INBOUND_TABLE(INBOUND_ROW)};
const struct param_row micro_params[] HAL_FLASH = {MICRO_PARAM_TABLE(PARAM_ROW)};
const struct stream_row micro_streams[] HAL_FLASH = {MICRO_STREAM_TABLE(STREAM_ROW)};
MICRO_INBOUND_TABLE(INBOUND_FITS)

#ifndef ROLE
ROLE_DEFINE(micro)
#endif

void micro_load(struct robot *robot)
{
    (void)robot; /* nothing but parameters is stored */
}

void micro_start(struct robot *robot)
{
    pose_start(micro_of(robot));
    ring_start(micro_of(robot));
}

void micro_act(struct robot *robot)
{
    struct micro *micro = micro_of(robot);

    micro->bumps = hal_bump(robot->board, micro_milli(micro, MICRO_PARAM_CONTACT_GAP));
    pose_step(micro);
    ring_step(micro);
    wheels_step(robot);
    move_step(micro);
}

void micro_override(struct robot *robot)
{
    (void)robot; /* there is no button */
}

bool micro_store(struct robot *robot)
{
    (void)robot;
    return true;
}

void micro_report(struct robot *robot)
{
    observation_report(micro_of(robot));
}

void micro_interrupt(struct robot *robot, uint8_t event, uint8_t reason)
{
    move_interrupt(micro_of(robot), event, reason);
}

void micro_drive(struct robot *robot, int16_t left, int16_t right, uint16_t duration)
{
    robot->wheels.effort[LEFT] = left;
    robot->wheels.effort[RIGHT] = right;
    wheels_run(robot, duration);
}

uint8_t micro_request(struct robot *robot, uint8_t stream, bool direct, const mavlink_command_long_t *command)
{
    (void)direct; /* all may be asked at once */
    return observation_ask(micro_of(robot), (uint8_t)(stream - STREAM_ROLE), command);
}

bool micro_send(struct robot *robot, uint8_t stream)
{
    return observation_answer(micro_of(robot), stream);
}

/* --- messages ----------------------------------------------------------------------------------------------------- */

bool micro_for_all(uint16_t id, const union inbound *message)
{
    (void)id;
    (void)message;
    return false;
}

/* SWARM_FIX, which counts for a robot that does not find its position itself. */
bool micro_hear(struct robot *robot, uint16_t id, const union inbound *message)
{
    const mavlink_swarm_fix_t *told = &micro_inbound_of(message)->fix;
    struct hal_fix fix;

    if (id != MAVLINK_MSG_ID_SWARM_FIX) {
        return false;
    }
    if (robot->session.open && told->session == robot->session.id && !hal_has_pose(robot->board)
        && told->age < micro_milli(micro_of(robot), MICRO_PARAM_FIX_AGE)) {
        fix.x = (int32_t)told->position[0] * UM_PER_MM;
        fix.y = (int32_t)told->position[1] * UM_PER_MM;
        fix.heading = angles_from_wire(told->heading);
        fix.age = told->age;
        pose_fix(micro_of(robot), &fix);
    }
    return true;
}

bool micro_ready(struct robot *robot, uint16_t id)
{
    (void)robot;
    (void)id;
    return true;
}

uint8_t micro_perform(struct robot *robot, uint16_t id, const union inbound *message)
{
    observation_pass(micro_of(robot));
    if (id == MAVLINK_MSG_ID_SWARM_MOVE) {
        return move_request(micro_of(robot), &micro_inbound_of(message)->move);
    }
    return ring_sense(micro_of(robot), &micro_inbound_of(message)->sense);
}

/* The observation of a move that has ended is sent again. */
uint8_t micro_repeat(struct robot *robot, uint16_t id, const union inbound *message, uint8_t reason)
{
    struct move *move = &micro_of(robot)->move;

    if (id == MAVLINK_MSG_ID_SWARM_MOVE && reason == ROBOT_REASON_NONE && move->reported
        && move->sequence == message->numbered.sequence) {
        move_repeat(micro_of(robot));
    }
    return reason;
}

void micro_acknowledged(struct robot *robot, uint16_t session, uint16_t sequence)
{
    if (session == micro_of(robot)->observations.ended.session && sequence == micro_of(robot)->observations.ended.sequence) {
        move_drop(micro_of(robot));
    }
}

void micro_forget(struct robot *robot)
{
    micro_of(robot)->move.reported = false;
    move_drop(micro_of(robot));
}
