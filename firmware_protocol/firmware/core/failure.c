/* Failures on request (MAV_CMD_INJECT_FAILURE), between the drivers and all else: what a sensor reads, what a wheel gets,
 * whether the host is heard. Nothing above knows; a wheel that is to stand still gets 0 whatever fails. */
#include "core/core.h"

#if FIRMWARE_FAILURES

static bool allowed(const struct robot *robot)
{
    return ROLE_OF(robot, param_fail_enable) != NO_PARAM && params_get(robot, ROLE_OF(robot, param_fail_enable)) != 0;
}

/* While armed, by the system that armed; in a contest by nobody. */
uint8_t failure_inject(struct robot *robot, struct sender from, const mavlink_command_long_t *command)
{
    uint16_t type = protocol_number(command->param2);
    uint16_t instance = protocol_number(command->param3);
    uint8_t first = FAILURE_SENSOR, count = ROLE_OF(robot, sensor_count), most = FAILURE_TYPE_GARBAGE;

    if (!allowed(robot)) {
        return MAV_RESULT_DENIED;
    }
    if (robot->state == ROBOT_STATE_COUNTDOWN || robot->state == ROBOT_STATE_CONTEST
        || (robot->keeper.by != KEEPER_NONE && !keeper_is(robot, from))) {
        return MAV_RESULT_TEMPORARILY_REJECTED;
    }
    switch (protocol_number(command->param1)) {
    case FAILURE_UNIT_SENSOR_DISTANCE_SENSOR:
        break;
    case FAILURE_UNIT_SYSTEM_BATTERY:
        first = FAILURE_BATTERY;
        count = 1;
        break;
    case FAILURE_UNIT_SYSTEM_MOTOR:
        first = FAILURE_WHEEL;
        count = 2;
        most = type == FAILURE_TYPE_SLOW ? FAILURE_TYPE_SLOW : FAILURE_TYPE_OFF;
        break;
    case FAILURE_UNIT_SYSTEM_MAVLINK_SIGNAL:
        first = FAILURE_HOST;
        count = 1;
        most = FAILURE_TYPE_OFF;
        break;
    default:
        return MAV_RESULT_UNSUPPORTED;
    }
    if (type > most) {
        return MAV_RESULT_UNSUPPORTED;
    }
    if (instance > count) {
        return MAV_RESULT_DENIED;
    }
    if (instance != 0) {
        first = (uint8_t)(first + instance - 1);
        count = 1;
    }
    memset(&robot->failures.type[first], (uint8_t)type, count);
    if (type != FAILURE_TYPE_OK) {
        notice_raise(robot, NOTICE_FAILURE);
    }
    return MAV_RESULT_ACCEPTED;
}

void failure_step(struct robot *robot)
{
    if (!allowed(robot)) {
        memset(robot->failures.type, FAILURE_TYPE_OK, sizeof robot->failures.type);
    }
}

uint16_t failure_read(struct robot *robot, uint8_t part, uint16_t reading, uint16_t before)
{
    switch (robot->failures.type[part]) {
    case FAILURE_TYPE_OFF:
        return 0;
    case FAILURE_TYPE_STUCK:
        return before;
    case FAILURE_TYPE_GARBAGE:
        robot->failures.noise = (uint16_t)(robot->failures.noise * 25173U + 13849U);
        return robot->failures.noise >> 6; /* 10 bits, as of a converter */
    default:
        return reading;
    }
}

int16_t failure_effort(const struct robot *robot, uint8_t side)
{
    int16_t effort = robot->wheels.effort[side];
    uint8_t type = robot->failures.type[FAILURE_WHEEL + side];

    return type == FAILURE_TYPE_OFF ? 0 : type == FAILURE_TYPE_SLOW ? (int16_t)(effort / 2) : effort;
}

bool failure_deaf(const struct robot *robot)
{
    return robot->failures.type[FAILURE_HOST] != FAILURE_TYPE_OK;
}

#else
typedef int failure_is_off; /* ISO C wants something here */
#endif
