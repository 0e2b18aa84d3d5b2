/* Messages sent at intervals, and on request. */
#include "core/core.h"

#define SHORTEST_MS ((int32_t)TICK_MS)
#define LONGEST_MS 60000L
#define LONGEST_HEARTBEAT_MS 5000L

static const struct stream_row rows[STREAMS_OWN] HAL_FLASH = {
    {MAVLINK_MSG_ID_HEARTBEAT, 1000},
    {MAVLINK_MSG_ID_SYS_STATUS, 1000},
    /* here the role's */
    {MAVLINK_MSG_ID_ROBOT_STATUS, 1000},
    {MAVLINK_MSG_ID_AUTOPILOT_VERSION, 0},
};

/* Streams that `requested` has a bit for. */
typedef char streams_fit[STREAMS_MOST <= 8 ? 1 : -1];

uint8_t stream_count(const struct robot *robot)
{
    return (uint8_t)(STREAMS_OWN + ROLE_OF(robot, stream_count));
}

bool stream_is_role(const struct robot *robot, uint8_t stream)
{
    return stream >= STREAM_ROLE && stream < STREAM_ROLE + ROLE_OF(robot, stream_count);
}

static const struct stream_row *row_of(const struct robot *robot, uint8_t stream)
{
    if (stream_is_role(robot, stream)) {
        return &ROLE_OF(robot, streams)[stream - STREAM_ROLE];
    }
    return &rows[stream < STREAM_ROLE ? stream : stream - ROLE_OF(robot, stream_count)];
}

static bool send_heartbeat(struct robot *robot)
{
    mavlink_heartbeat_t heartbeat;

    heartbeat.custom_mode = robot->state;
    heartbeat.type = MAV_TYPE_GROUND_ROVER;
    heartbeat.autopilot = MAV_AUTOPILOT_GENERIC;
    heartbeat.base_mode = MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | MAV_MODE_FLAG_MANUAL_INPUT_ENABLED;
    if (states_armed(robot)) {
        heartbeat.base_mode |= MAV_MODE_FLAG_SAFETY_ARMED;
    }
    heartbeat.system_status = robot->state == ROBOT_STATE_STOPPED ? MAV_STATE_EMERGENCY
                              : states_armed(robot)                ? MAV_STATE_ACTIVE
                                                                   : MAV_STATE_STANDBY;
    heartbeat.mavlink_version = 3;
    return SEND(robot, HEARTBEAT, &heartbeat);
}

/* Share of the host's frames that were lost, in 1/10000. */
static uint16_t drop_rate(const struct counters *counters)
{
    uint32_t lost = counters->lost;
    uint32_t all = counters->good + lost;

    while (lost > 400000UL) { /* keeps the product within 32 bits */
        lost /= 2;
        all /= 2;
    }
    return all == 0 ? 0 : (uint16_t)(lost * 10000U / all);
}

#define SENSORS (MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS | MAV_SYS_STATUS_SENSOR_BATTERY | MAV_SYS_STATUS_PREARM_CHECK)

/* What there is not counts as healthy: ground stations report anything else as broken, a geofence as breached. */
static void tell_sensors(const struct robot *robot, mavlink_sys_status_t *status)
{
    status->onboard_control_sensors_present = SENSORS;
    status->onboard_control_sensors_enabled = SENSORS;
    if (!states_armed(robot)) {
        status->onboard_control_sensors_enabled = SENSORS & ~(uint32_t)MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS;
    }
    status->onboard_control_sensors_health = UINT32_MAX;
    if (robot->battery < (uint16_t)params_get(robot, ROLE_OF(robot, param_batt_low))) {
        status->onboard_control_sensors_health &= ~(uint32_t)MAV_SYS_STATUS_SENSOR_BATTERY;
    }
    if (robot->state == ROBOT_STATE_STOPPED) {
        status->onboard_control_sensors_health &= ~(uint32_t)MAV_SYS_STATUS_PREARM_CHECK;
    }
}

static bool send_sys_status(struct robot *robot)
{
    mavlink_sys_status_t status;
    uint32_t errors = robot->counters.bad_checksum + robot->counters.unknown;

#if FIRMWARE_SIGNING
    errors += (uint32_t)robot->signing.not_signed + robot->signing.bad + robot->signing.replayed;
#endif
    memset(&status, 0, sizeof status);
    tell_sensors(robot, &status);
    status.load = robot->time.load;
    status.voltage_battery = robot->battery;
    status.current_battery = -1;
    status.battery_remaining = -1;
    status.drop_rate_comm = drop_rate(&robot->counters);
    status.errors_comm = (uint16_t)(errors > UINT16_MAX ? UINT16_MAX : errors);
    return SEND(robot, SYS_STATUS, &status);
}

static bool send_status(struct robot *robot)
{
    mavlink_robot_status_t status;

    status.time = robot->time.micros;
    status.maneuvers = robot->counters.maneuvers;
    status.good = robot->counters.good;
    status.bad_checksum = robot->counters.bad_checksum;
    status.unknown = robot->counters.unknown;
    status.lost = robot->counters.lost;
    status.boot_count = robot->counters.boots;
    status.session = robot->session.id;
    status.sequence = robot->session.last;
    status.state = robot->state;
#if FIRMWARE_SIGNING
    status.not_signed = robot->signing.not_signed;
    status.bad_signature = robot->signing.bad;
    status.replayed = robot->signing.replayed;
#else
    status.not_signed = 0;
    status.bad_signature = 0;
    status.replayed = 0;
#endif
    return SEND(robot, ROBOT_STATUS, &status);
}

static bool send_version(struct robot *robot)
{
    mavlink_autopilot_version_t version;

    memset(&version, 0, sizeof version);
    version.capabilities = MAV_PROTOCOL_CAPABILITY_MAVLINK2 | MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
                           | MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION | MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST;
    version.flight_sw_version = FIRMWARE_VERSION;
    version.middleware_sw_version = PROTOCOL_VERSION;
    version.product_id = ROLE_OF(robot, product);
    version.uid = hal_uid(robot->board);
    return SEND(robot, AUTOPILOT_VERSION, &version);
}

static bool send_one(struct robot *robot, uint8_t stream)
{
    if (stream == STREAM_HEARTBEAT) {
        return send_heartbeat(robot);
    }
    if (stream == STREAM_SYS_STATUS) {
        return send_sys_status(robot);
    }
    stream = (uint8_t)(stream - STREAM_ROLE);
    if (stream < ROLE_OF(robot, stream_count)) {
        return ROLE_OF(robot, send)(robot, stream);
    }
    return stream == ROLE_OF(robot, stream_count) ? send_status(robot) : send_version(robot);
}

uint8_t stream_find(const struct robot *robot, uint32_t message)
{
    uint8_t i;

    for (i = 0; i < stream_count(robot) && flash_u16(&row_of(robot, i)->message) != message; i++) {
    }
    return i;
}

/* interval: us; 0 the default, -1 never. */
uint8_t stream_set_interval(struct robot *robot, uint32_t message, int32_t interval)
{
    uint8_t stream = stream_find(robot, message);
    uint16_t ms;

    if (stream == stream_count(robot)) {
        return MAV_RESULT_UNSUPPORTED;
    }
    if (interval > LONGEST_MS * 1000
        || (stream == STREAM_HEARTBEAT && (interval < 0 || interval > LONGEST_HEARTBEAT_MS * 1000))) {
        return MAV_RESULT_DENIED; /* a robot without a heartbeat is a lost one */
    }
    if (interval < 0) {
        ms = 0;
    } else if (interval == 0) {
        ms = flash_u16(&row_of(robot, stream)->interval);
    } else {
        ms = (uint16_t)(interval / 1000 < SHORTEST_MS ? SHORTEST_MS : interval / 1000);
    }
    robot->streams.interval[stream] = ms;
    robot->streams.due[stream] = robot->time.now + ms;
    return MAV_RESULT_ACCEPTED;
}

void stream_start(struct robot *robot)
{
    uint8_t i;

    for (i = 0; i < stream_count(robot); i++) {
        robot->streams.interval[i] = flash_u16(&row_of(robot, i)->interval);
    }
}

/* What finds no room is tried again in the next tick. */
void stream_step(struct robot *robot)
{
    struct streams *streams = &robot->streams;
    uint8_t i;

    for (i = 0; i < stream_count(robot); i++) {
        bool due = streams->interval[i] != 0 && time_due(robot, streams->due[i]);
        bool requested = (streams->requested & (1U << i)) != 0;

#if FIRMWARE_SIGNING
        if (signing_late(robot)) {
            return;
        }
#endif
        if ((due || requested) && send_one(robot, i)) {
            streams->requested &= (uint8_t) ~(1U << i);
            if (due) {
                streams->due[i] += streams->interval[i];
                if (time_due(robot, streams->due[i])) { /* late by more than one: don't catch up */
                    streams->due[i] = robot->time.now + streams->interval[i];
                }
            }
        }
    }
}
