/* The wheels: trimmed effort, a deadline while driven from afar, and nothing at all in a state that stands still. */
#include "core.h"

enum { FULL = 1000 };

static int16_t trimmed(const struct junior *robot, uint8_t trim, int16_t effort)
{
    return (int16_t)((int32_t)effort * params_get(robot, trim) / FULL);
}

void wheels_set(struct junior *robot, int16_t left, int16_t right)
{
    robot->wheels.effort[LEFT] = trimmed(robot, PARAM_TRIM_LEFT, left);
    robot->wheels.effort[RIGHT] = trimmed(robot, PARAM_TRIM_RIGHT, right);
}

void wheels_stop(struct junior *robot)
{
    robot->wheels.effort[LEFT] = 0;
    robot->wheels.effort[RIGHT] = 0;
}

/* The caller has put the robot into DRIVING. */
void wheels_drive(struct junior *robot, int16_t left, int16_t right, uint16_t duration)
{
    wheels_set(robot, left, right);
    wheels_run(robot, duration, false);
}

/* In DRIVING, the wheels go on as they are set: this long, and if guarded not over the border. */
void wheels_run(struct junior *robot, uint16_t duration, bool guarded)
{
    robot->wheels.deadline = robot->time.now + duration;
    robot->wheels.guarded = guarded;
    wheels_step(robot); /* no time at all is a stop */
}

void wheels_step(struct junior *robot)
{
    if (robot->state == ROBOT_STATE_DRIVING
        && (time_due(robot, robot->wheels.deadline) || (robot->wheels.guarded && sensing_off_ring(robot) != 0))) {
        states_fire(robot, EVENT_DONE, ROBOT_REASON_NONE);
    }
}

void wheels_output(struct junior *robot)
{
    hal_set_wheels(robot->board, failure_effort(robot, LEFT), failure_effort(robot, RIGHT));
}
