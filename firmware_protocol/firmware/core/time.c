/* The robot's own time: since boot, in us for messages and in ms for deadlines. */
#include "core/core.h"

void time_start(struct robot *robot)
{
    robot->time.power_on = hal_micros(robot->board);
}

void time_tick(struct robot *robot)
{
    struct time *time = &robot->time;
    uint64_t micros = hal_micros(robot->board) - time->power_on;
    uint32_t passed = (uint32_t)(micros - time->micros) + time->carry;
    uint32_t ms = passed <= UINT16_MAX ? (uint16_t)passed / 1000U : passed / 1000U; /* the former is quick on 8 bits */

    time->micros = micros;
    time->elapsed = (uint16_t)(ms > 1000U ? 1000U : ms);
    time->now += ms;
    time->carry = (uint16_t)(passed - ms * 1000U);
}

/* At the end of a control period: what share of it was used. */
void time_measure_load(struct robot *robot)
{
    robot->time.load = hal_used(robot->board) / TICK_MS; /* us of 1000 times as many: permille */
}

bool time_due(const struct robot *robot, uint32_t deadline)
{
    return (int32_t)(robot->time.now - deadline) >= 0;
}
