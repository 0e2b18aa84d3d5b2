/* Junior's wheels: trimmed effort, and the border ends what is guarded. */
#include "junior/modules.h"

enum { FULL = 1000 };

static int16_t trimmed(const struct junior *junior, uint8_t trim, int16_t effort)
{
    return (int16_t)((int32_t)effort * params_get(&junior->robot, trim) / FULL);
}

void driving_set(struct junior *junior, int16_t left, int16_t right)
{
    junior->robot.wheels.effort[LEFT] = trimmed(junior, JUNIOR_PARAM_TRIM_LEFT, left);
    junior->robot.wheels.effort[RIGHT] = trimmed(junior, JUNIOR_PARAM_TRIM_RIGHT, right);
}

/* In DRIVING, the wheels go on as they are set: this long, and if guarded not over the border. */
void driving_run(struct junior *junior, uint16_t duration, bool guarded)
{
    wheels_run(&junior->robot, duration);
    junior->guarded = guarded;
    driving_step(junior); /* no time at all is a stop */
}

void driving_step(struct junior *junior)
{
    wheels_step(&junior->robot);
    if (junior->robot.state == ROBOT_STATE_DRIVING && junior->guarded && sensing_off_ring(junior) != 0) {
        states_fire(&junior->robot, EVENT_DONE, ROBOT_REASON_NONE);
    }
}
