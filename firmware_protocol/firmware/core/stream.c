/* Messages sent at intervals, and on request. */
#include "core.h"

#define SHORTEST_MS ((int32_t)TICK_MS)
#define LONGEST_MS 60000L
#define LONGEST_HEARTBEAT_MS 5000L

static const uint16_t messages[STREAMS] HAL_FLASH = {
    [STREAM_HEARTBEAT] = MAVLINK_MSG_ID_HEARTBEAT,
    [STREAM_SYS_STATUS] = MAVLINK_MSG_ID_SYS_STATUS,
    [STREAM_SENSORS] = MAVLINK_MSG_ID_JUNIOR_SENSORS,
    [STREAM_STATUS] = MAVLINK_MSG_ID_ROBOT_STATUS,
    [STREAM_VERSION] = MAVLINK_MSG_ID_AUTOPILOT_VERSION,
};

static const uint16_t default_intervals[STREAMS] HAL_FLASH = {
    [STREAM_HEARTBEAT] = 1000,
    [STREAM_SYS_STATUS] = 1000,
    [STREAM_SENSORS] = 20,
    [STREAM_STATUS] = 1000,
    [STREAM_VERSION] = 0, /* on request only */
};

static bool send_heartbeat(struct junior *robot)
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
static void tell_sensors(const struct junior *robot, mavlink_sys_status_t *status)
{
    status->onboard_control_sensors_present = SENSORS;
    status->onboard_control_sensors_enabled = SENSORS;
    if (!states_armed(robot)) {
        status->onboard_control_sensors_enabled = SENSORS & ~(uint32_t)MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS;
    }
    status->onboard_control_sensors_health = UINT32_MAX;
    if (robot->sensing.battery < (uint16_t)params_get(robot, PARAM_BATT_LOW)) {
        status->onboard_control_sensors_health &= ~(uint32_t)MAV_SYS_STATUS_SENSOR_BATTERY;
    }
    if (robot->state == ROBOT_STATE_STOPPED) {
        status->onboard_control_sensors_health &= ~(uint32_t)MAV_SYS_STATUS_PREARM_CHECK;
    }
}

static bool send_sys_status(struct junior *robot)
{
    mavlink_sys_status_t status;
    uint32_t errors = robot->counters.bad_checksum + robot->counters.unknown;

#if JUNIOR_SIGNING
    errors += (uint32_t)robot->signing.not_signed + robot->signing.bad + robot->signing.replayed;
#endif
    memset(&status, 0, sizeof status);
    tell_sensors(robot, &status);
    status.load = robot->time.load;
    status.voltage_battery = robot->sensing.battery;
    status.current_battery = -1;
    status.battery_remaining = -1;
    status.drop_rate_comm = drop_rate(&robot->counters);
    status.errors_comm = (uint16_t)(errors > UINT16_MAX ? UINT16_MAX : errors);
    return SEND(robot, SYS_STATUS, &status);
}

static bool send_sensors(struct junior *robot)
{
    const struct sensing *sensing = &robot->sensing;
    mavlink_junior_sensors_t sensors;

    sensors.time = robot->time.micros;
    memcpy(sensors.travel, sensing->travel_mm, sizeof sensors.travel);
    memcpy(sensors.eye, sensing->eye, sizeof sensors.eye);
    memcpy(sensors.floor, sensing->floor, sizeof sensors.floor);
    sensors.battery = sensing->battery;
    sensors.flags = sensing->flags;
    return SEND(robot, JUNIOR_SENSORS, &sensors);
}

static bool send_status(struct junior *robot)
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
#if JUNIOR_SIGNING
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

static bool send_version(struct junior *robot)
{
    mavlink_autopilot_version_t version;

    memset(&version, 0, sizeof version);
    version.capabilities = MAV_PROTOCOL_CAPABILITY_MAVLINK2 | MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
                           | MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION | MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST;
    version.flight_sw_version = FIRMWARE_VERSION;
    version.middleware_sw_version = PROTOCOL_VERSION;
    version.uid = hal_uid(robot->board);
    return SEND(robot, AUTOPILOT_VERSION, &version);
}

static bool send_one(struct junior *robot, uint8_t stream)
{
    switch (stream) {
    case STREAM_HEARTBEAT:
        return send_heartbeat(robot);
    case STREAM_SYS_STATUS:
        return send_sys_status(robot);
    case STREAM_SENSORS:
        return send_sensors(robot);
    case STREAM_STATUS:
        return send_status(robot);
    default:
        return send_version(robot);
    }
}

uint8_t stream_find(uint32_t message)
{
    uint8_t i;

    for (i = 0; i < STREAMS && flash_u16(&messages[i]) != message; i++) {
    }
    return i;
}

/* interval: us; 0 the default, -1 never. */
uint8_t stream_set_interval(struct junior *robot, uint32_t message, int32_t interval)
{
    uint8_t stream = stream_find(message);
    uint16_t ms;

    if (stream == STREAMS) {
        return MAV_RESULT_UNSUPPORTED;
    }
    if (interval > LONGEST_MS * 1000
        || (stream == STREAM_HEARTBEAT && (interval < 0 || interval > LONGEST_HEARTBEAT_MS * 1000))) {
        return MAV_RESULT_DENIED; /* a robot without a heartbeat is a lost one */
    }
    if (interval < 0) {
        ms = 0;
    } else if (interval == 0) {
        ms = flash_u16(&default_intervals[stream]);
    } else {
        ms = (uint16_t)(interval / 1000 < SHORTEST_MS ? SHORTEST_MS : interval / 1000);
    }
    robot->streams.interval[stream] = ms;
    robot->streams.due[stream] = robot->time.now + ms;
    return MAV_RESULT_ACCEPTED;
}

void stream_start(struct junior *robot)
{
    uint8_t i;

    for (i = 0; i < STREAMS; i++) {
        robot->streams.interval[i] = flash_u16(&default_intervals[i]);
    }
}

/* What finds no room is tried again in the next tick. */
void stream_step(struct junior *robot)
{
    struct streams *streams = &robot->streams;
    uint8_t i;

    for (i = 0; i < STREAMS; i++) {
        bool due = streams->interval[i] != 0 && time_due(robot, streams->due[i]);
        bool requested = (streams->requested & (1U << i)) != 0;

#if JUNIOR_SIGNING
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
