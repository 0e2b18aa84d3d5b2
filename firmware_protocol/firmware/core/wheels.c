/* The wheels: a deadline while driven from afar, and nothing at all in a state that stands still. A role sets the effort. */
#include "core/core.h"

void wheels_stop(struct robot *robot)
{
    robot->wheels.effort[LEFT] = 0;
    robot->wheels.effort[RIGHT] = 0;
}

void wheels_step(struct robot *robot)
{
    if (robot->state == ROBOT_STATE_DRIVING && time_due(robot, robot->wheels.deadline)) {
        states_fire(robot, EVENT_DONE, ROBOT_REASON_NONE);
    }
}

void wheels_output(struct robot *robot)
{
    hal_set_wheels(robot->board, failure_effort(robot, LEFT), failure_effort(robot, RIGHT));
}
