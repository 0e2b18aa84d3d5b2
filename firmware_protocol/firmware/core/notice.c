/* STATUSTEXT: a line for a person, not more than four a second. */
#include "core/core.h"

enum { TEXT = 50, APART_MS = 250, BATTERY_APART_MS = 30000, BATTERY_STEADY_MS = 1000 };

static const char texts[NOTICES][TEXT] HAL_FLASH = {
    "Stopped: no word from the host",
    "Emergency stop: disarm, then arm",
    "Battery low",
    "Stored parameters were damaged: defaults restored",
#if FIRMWARE_FAILURES
    "A failure was asked for, and is rehearsed",
#endif
};

void notice_raise(struct robot *robot, uint8_t notice)
{
    robot->notices.pending |= (uint8_t)(1U << notice);
}

/* Moves a time that has passed to now: 24 days later it would lie ahead again. */
static void keep_up(const struct robot *robot, uint32_t *time)
{
    if (time_due(robot, *time)) {
        *time = robot->time.now;
    }
}

static void watch_battery(struct robot *robot)
{
    if (robot->battery >= (uint16_t)params_get(robot, ROLE_OF(robot, param_batt_low))) {
        robot->notices.battery_good = robot->time.now;
    } else if (robot->time.now - robot->notices.battery_good >= BATTERY_STEADY_MS
               && time_due(robot, robot->notices.battery_next)) {
        robot->notices.battery_next = robot->time.now + BATTERY_APART_MS;
        notice_raise(robot, NOTICE_BATTERY);
    }
}

void notice_step(struct robot *robot)
{
    mavlink_statustext_t text;
    uint8_t notice = 0;

    keep_up(robot, &robot->notices.next);
    keep_up(robot, &robot->notices.battery_next);
    watch_battery(robot);
    if (robot->notices.pending == 0 || !time_due(robot, robot->notices.next)) {
        return;
    }
    while (!(robot->notices.pending & (1U << notice))) {
        notice++;
    }
    memset(&text, 0, sizeof text);
    text.severity = notice == NOTICE_ESTOP ? MAV_SEVERITY_CRITICAL : MAV_SEVERITY_WARNING;
    flash_copy(text.text, texts[notice], TEXT);
    if (SEND(robot, STATUSTEXT, &text)) {
        robot->notices.pending &= (uint8_t) ~(1U << notice);
        robot->notices.next = robot->time.now + APART_MS;
    }
}
