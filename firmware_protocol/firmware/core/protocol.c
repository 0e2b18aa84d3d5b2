/* Which module a message is for. */
#include "core/core.h"

enum { MANUAL_MS = 250 /* dead-man of MANUAL_CONTROL */, NOT_GIVEN = INT16_MAX };

static void answer_ping(struct robot *robot, struct sender from, const mavlink_ping_t *ping)
{
    mavlink_ping_t answer = *ping;

    if (ping->target_system != 0) {
        return; /* an answer to a question of ours; we ask none */
    }
    answer.target_system = from.system;
    answer.target_component = from.component;
    SEND(robot, PING, &answer);
}

static void answer_timesync(struct robot *robot, struct sender from, const mavlink_timesync_t *question)
{
    mavlink_timesync_t answer;

    if (question->tc1 != 0) {
        return;
    }
    memset(&answer, 0, sizeof answer);
    answer.tc1 = (int64_t)(robot->time.micros * 1000U);
    answer.ts1 = question->ts1;
    answer.target_system = from.system;
    answer.target_component = from.component;
    SEND(robot, TIMESYNC, &answer);
}

/* Ground stations ask everybody for missions, and wait: there are none. */
static void answer_mission_list(struct robot *robot, struct sender from, uint8_t mission_type)
{
    mavlink_mission_count_t answer;

    memset(&answer, 0, sizeof answer);
    answer.target_system = from.system;
    answer.target_component = from.component;
    answer.mission_type = mission_type;
    SEND(robot, MISSION_COUNT, &answer);
}

static bool stick(int16_t *value)
{
    if (*value == NOT_GIVEN) {
        *value = 0;
    }
    return *value >= -1000 && *value <= 1000;
}

static int16_t limited(int16_t value)
{
    return value < -1000 ? -1000 : value > 1000 ? 1000 : value;
}

/* Only from the ground station that armed: what a host has armed, another program at its address must not drive. */
static void drive_manually(struct robot *robot, struct sender from, const mavlink_manual_control_t *control)
{
    int16_t forward = control->x;
    int16_t turn = control->r;

    if (robot->keeper.by != KEEPER_SENDER || !keeper_is(robot, from) || !stick(&forward) || !stick(&turn)
        || states_fire(robot, EVENT_MANUAL, ROBOT_REASON_BY_COMMAND) != ROBOT_REASON_NONE) {
        return;
    }
    ROLE_OF(robot, drive)(robot, limited((int16_t)(forward + turn)), limited((int16_t)(forward - turn)), MANUAL_MS);
}

uint16_t protocol_number(float param)
{
    return param >= 0.0f && param < 65535.0f ? (uint16_t)param : UINT16_MAX;
}

/* What is said to all robots. */
static bool for_all(const struct robot *robot, uint16_t id, const union inbound *message)
{
    return id == MAVLINK_MSG_ID_PING || id == MAVLINK_MSG_ID_TIMESYNC || id == MAVLINK_MSG_ID_COMMAND_LONG
           || id == MAVLINK_MSG_ID_ROBOT_ALIVE
           || ROLE_OF(robot, for_all)(id, message);
}

void protocol_handle(struct robot *robot, struct sender from, bool direct, uint16_t id, const union inbound *message)
{
    if (!direct && !for_all(robot, id, message)) {
        return;
    }
    switch (id) {
    case MAVLINK_MSG_ID_HEARTBEAT: /* being heard is all it is for */
        break;
    case MAVLINK_MSG_ID_PING:
        answer_ping(robot, from, &message->ping);
        break;
    case MAVLINK_MSG_ID_TIMESYNC:
        answer_timesync(robot, from, &message->timesync);
        break;
    case MAVLINK_MSG_ID_PARAM_REQUEST_READ:
        params_handle_read(robot, &message->param_request_read);
        break;
    case MAVLINK_MSG_ID_PARAM_REQUEST_LIST:
        robot->params.list_next = 0;
        break;
    case MAVLINK_MSG_ID_PARAM_SET:
        params_handle_set(robot, &message->param_set);
        break;
    case MAVLINK_MSG_ID_MISSION_REQUEST_LIST:
        answer_mission_list(robot, from, message->mission_request_list.mission_type);
        break;
    case MAVLINK_MSG_ID_MANUAL_CONTROL:
        drive_manually(robot, from, &message->manual_control);
        break;
    case MAVLINK_MSG_ID_COMMAND_LONG:
        command_handle(robot, from, direct, &message->command_long);
        break;
#if FIRMWARE_SIGNING
    case MAVLINK_MSG_ID_SETUP_SIGNING:
        signing_setup(robot, &message->setup_signing);
        break;
#endif
    case MAVLINK_MSG_ID_ROBOT_RESULT_ACK:
        ROLE_OF(robot, acknowledged)(robot, message->result_ack.session, message->result_ack.sequence);
        break;
    case MAVLINK_MSG_ID_ROBOT_ALIVE:
        keeper_alive(robot, message->alive.host);
        break;
    case MAVLINK_MSG_ID_ROBOT_SESSION:
        numbered_open(robot, from, &message->session);
        break;
    default:
        if (ROLE_OF(robot, unnumbered_count) == 0 || !ROLE_OF(robot, hear)(robot, id, message)) {
            numbered_handle(robot, from, id, message);
        }
        break;
    }
}
