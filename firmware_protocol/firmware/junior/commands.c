/* Junior's numbered messages: wheels, maneuvers, memory and contest. */
#include "junior/modules.h"

static uint8_t perform(struct junior *junior, const mavlink_junior_maneuver_t *request)
{
    struct maneuver_plan plan;
    uint8_t reason;

    if (!maneuver_read(&plan, request->period, request->options, request->count, request->actions)) {
        return ROBOT_REASON_BAD_VALUE;
    }
    reason = states_fire(&junior->robot, EVENT_PERFORM, ROBOT_REASON_BY_COMMAND);
    if (reason == ROBOT_REASON_NONE) {
        maneuver_begin(junior, &plan, true, request->sequence);
    }
    return reason;
}

static uint8_t drive(struct robot *robot, const mavlink_junior_wheels_t *request)
{
    uint8_t reason;

    if (request->speed[LEFT] < -1000 || request->speed[LEFT] > 1000 || request->speed[RIGHT] < -1000
        || request->speed[RIGHT] > 1000 || request->duration > 5000) {
        return ROBOT_REASON_BAD_VALUE;
    }
    reason = states_fire(robot, EVENT_DRIVE, ROBOT_REASON_BY_COMMAND);
    if (reason == ROBOT_REASON_NONE) {
        junior_drive(robot, request->speed[LEFT], request->speed[RIGHT], request->duration);
    }
    return reason;
}

static uint8_t contest(struct junior *junior, const mavlink_junior_contest_t *request)
{
    if (request->command == JUNIOR_CONTEST_COMMAND_STOP) {
        return states_fire(&junior->robot, EVENT_CONTEST_STOP, ROBOT_REASON_BY_COMMAND);
    }
    if (request->command != JUNIOR_CONTEST_COMMAND_START || request->countdown > 60000U) {
        return ROBOT_REASON_BAD_VALUE;
    }
    return contest_begin(junior, request->countdown);
}

bool junior_hear(struct robot *robot, uint16_t id, const union inbound *message) /* unreachable: unnumbered_count is 0 */
{
    (void)robot;
    (void)id;
    (void)message;
    return false; /* unreachable: every message of ours is numbered */
}

bool junior_for_all(uint16_t id, const union inbound *message)
{
    return id == MAVLINK_MSG_ID_JUNIOR_CONTEST
           && junior_inbound_of(message)->contest.command == JUNIOR_CONTEST_COMMAND_STOP;
}

/* A maneuver is not taken for storing while another is being stored. */
bool junior_ready(struct robot *robot, uint16_t id)
{
    return id != MAVLINK_MSG_ID_JUNIOR_MEMORY_WRITE || memory_ready(junior_of(robot));
}

uint8_t junior_perform(struct robot *robot, uint16_t id, const union inbound *message)
{
    const union junior_inbound *ours = junior_inbound_of(message);
    struct junior *junior = junior_of(robot);

    switch (id) {
    case MAVLINK_MSG_ID_JUNIOR_WHEELS:
        return drive(robot, &ours->wheels);
    case MAVLINK_MSG_ID_JUNIOR_MANEUVER:
        return perform(junior, &ours->maneuver);
    case MAVLINK_MSG_ID_JUNIOR_MEMORY_WRITE:
        return memory_handle_write(junior, &ours->memory_write);
    case MAVLINK_MSG_ID_JUNIOR_MEMORY_READ:
        return memory_handle_read(junior, &ours->memory_read);
    default:
        return contest(junior, &ours->contest);
    }
}

/* What was read is read again; the result of a maneuver that has ended is sent again. */
uint8_t junior_repeat(struct robot *robot, uint16_t id, const union inbound *message, uint8_t reason)
{
    struct maneuver *maneuver = &junior_of(robot)->maneuver;

    if (id == MAVLINK_MSG_ID_JUNIOR_MEMORY_READ && reason == ROBOT_REASON_NONE) {
        return memory_handle_read(junior_of(robot), &junior_inbound_of(message)->memory_read);
    }
    if (id == MAVLINK_MSG_ID_JUNIOR_MANEUVER && maneuver->result.sequence == message->numbered.sequence
        && maneuver->reported && maneuver->phase == PHASE_IDLE) {
        maneuver->result_pending = true;
        maneuver->result_due = robot->time.now;
    }
    return reason;
}

void junior_acknowledged(struct robot *robot, uint16_t session, uint16_t sequence)
{
    struct maneuver *maneuver = &junior_of(robot)->maneuver;

    if (session == maneuver->result.session && sequence == maneuver->result.sequence) {
        maneuver->result_pending = false;
    }
}

void junior_forget(struct robot *robot)
{
    struct junior *junior = junior_of(robot);

    junior->maneuver.result_pending = false;
    junior->maneuver.reported = false;
    junior->memory.asked = false;
}
