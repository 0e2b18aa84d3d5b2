/* The floor reflex: back off from the border, turn away from the side that saw it. It ends the maneuver. */
#include "core.h"

static void turn(struct junior *robot)
{
    robot->maneuver.phase = PHASE_TURNING;
    robot->maneuver.phase_end += (uint32_t)params_get(robot, PARAM_REFLEX_TURN);
    maneuver_wheels(robot, robot->maneuver.turn_left ? JUNIOR_ACTION_L : JUNIOR_ACTION_R);
}

/* True when the reflex took over. Seen by both sides, or by the left: turn right. */
bool reflex_begin(struct junior *robot)
{
    uint8_t off_ring = sensing_off_ring(robot);
    int16_t speed = (int16_t)-params_get(robot, PARAM_REFLEX_SPEED);

    if (off_ring == 0) {
        return false;
    }
    robot->maneuver.turn_left = off_ring == 1U << RIGHT;
    robot->maneuver.phase = PHASE_BACKING;
    robot->maneuver.phase_end = robot->time.now + (uint32_t)params_get(robot, PARAM_REFLEX_BACK);
    wheels_set(robot, speed, speed);
    reflex_step(robot);
    return true;
}

void reflex_step(struct junior *robot)
{
    if (robot->maneuver.phase == PHASE_BACKING && time_due(robot, robot->maneuver.phase_end)) {
        turn(robot);
    }
    if (robot->maneuver.phase == PHASE_TURNING && time_due(robot, robot->maneuver.phase_end)) {
        maneuver_conclude(robot, JUNIOR_OUTCOME_FLOOR_REFLEX);
    }
}
