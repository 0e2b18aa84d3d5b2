/* COMMAND_LONG: the standard commands, and their answers. */
#include "core/core.h"

enum { REBOOT_DELAY_MS = 20 /* lets the answer out */ };

enum choice { NO, YES, NEITHER };

static uint8_t choice_of(float param)
{
    return param >= 0.0f && param <= 0.0f ? NO : param >= 1.0f && param <= 1.0f ? YES : NEITHER;
}

/* A host names, as `param3`, the number of its session; a ground station leaves that empty, 0 or NaN. */
static uint8_t arm(struct robot *robot, struct sender from, uint8_t choice, float number)
{
    float host = (float)robot->session.host;
    bool named = number > 0.0f;

    if (choice == NO) {
        states_fire(robot, EVENT_DISARM, ROBOT_REASON_DISARMED);
        return MAV_RESULT_ACCEPTED;
    }
    if (choice != YES || (named && (!robot->session.open || number < host || number > host))) {
        return MAV_RESULT_DENIED;
    }
    if (states_fire(robot, EVENT_ARM, ROBOT_REASON_NONE) != ROBOT_REASON_NONE) {
        return MAV_RESULT_TEMPORARILY_REJECTED;
    }
    keeper_set(robot, named ? KEEPER_SESSION : KEEPER_SENDER, from);
    return MAV_RESULT_ACCEPTED;
}

static uint8_t stop(struct robot *robot, uint8_t choice)
{
    if (choice != YES) {
        return MAV_RESULT_DENIED; /* it is ended by disarming */
    }
    if (robot->state != ROBOT_STATE_STOPPED) {
        states_fire(robot, EVENT_ESTOP, ROBOT_REASON_EMERGENCY_STOP);
        notice_raise(robot, NOTICE_ESTOP);
    }
    return MAV_RESULT_ACCEPTED;
}

static uint8_t reboot(struct robot *robot, uint8_t choice)
{
    if (choice != YES) {
        return MAV_RESULT_DENIED;
    }
    states_fire(robot, EVENT_DISARM, ROBOT_REASON_DISARMED);
    robot->reboot = true;
    robot->reboot_at = robot->time.now + REBOOT_DELAY_MS;
    return MAV_RESULT_ACCEPTED;
}

static uint8_t set_interval(struct robot *robot, float message, float interval)
{
    if (!(interval >= -1.0f && interval <= 2.0e9f)) {
        return MAV_RESULT_DENIED;
    }
    return stream_set_interval(robot, protocol_number(message), (int32_t)interval);
}

static uint8_t request(struct robot *robot, bool direct, const mavlink_command_long_t *command)
{
    uint8_t stream = stream_find(robot, protocol_number(command->param1));
    uint8_t result = MAV_RESULT_ACCEPTED;

    if (stream == stream_count(robot)) {
        return MAV_RESULT_UNSUPPORTED;
    }
    if (ROLE_OF(robot, stream_asked) && stream_is_role(robot, stream)) {
        result = ROLE_OF(robot, request)(robot, stream, direct, command);
    }
    if (result == MAV_RESULT_ACCEPTED) {
        robot->streams.requested |= (uint8_t)(1U << stream); /* sent in this tick, after the answer */
    }
    return result;
}

static bool asked_of_all(const struct robot *robot, const mavlink_command_long_t *command)
{
    return ROLE_OF(robot, stream_asked) && stream_is_role(robot, stream_find(robot, protocol_number(command->param1)));
}

void command_handle(struct robot *robot, struct sender from, bool direct, const mavlink_command_long_t *command)
{
    mavlink_command_ack_t ack;
    uint8_t choice = choice_of(command->param1);
    uint8_t result;

    if (!direct && command->command != MAV_CMD_DO_FLIGHTTERMINATION
        && !(command->command == MAV_CMD_REQUEST_MESSAGE && asked_of_all(robot, command))
        && !(command->command == MAV_CMD_COMPONENT_ARM_DISARM && choice == NO)) {
        return; /* to all, only stop, e-stop, and what a role says may be asked of all */
    }
    switch (command->command) {
    case MAV_CMD_COMPONENT_ARM_DISARM:
        result = arm(robot, from, choice, command->param3);
        break;
    case MAV_CMD_DO_FLIGHTTERMINATION:
        result = stop(robot, choice);
        break;
    case MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN:
        result = reboot(robot, choice);
        break;
    case MAV_CMD_SET_MESSAGE_INTERVAL:
        result = set_interval(robot, command->param1, command->param2);
        break;
    case MAV_CMD_REQUEST_MESSAGE:
        result = request(robot, direct, command);
        if (ROLE_OF(robot, stream_asked) && !direct) {
            return; /* what was asked for is the answer */
        }
        break;
#if FIRMWARE_FAILURES
    case MAV_CMD_INJECT_FAILURE:
        result = failure_inject(robot, from, command);
        break;
#endif
    default:
        result = MAV_RESULT_UNSUPPORTED;
        break;
    }
    memset(&ack, 0, sizeof ack);
    ack.command = command->command;
    ack.result = result;
    ack.target_system = from.system;
    ack.target_component = from.component;
    SEND(robot, COMMAND_ACK, &ack);
}
