/* The floor reflex: back off from the border, turn away from the side that saw it. It ends the maneuver. */
#include "junior/modules.h"

static void turn(struct junior *junior)
{
    junior->maneuver.phase = PHASE_TURNING;
    junior->maneuver.phase_end += (uint32_t)params_get(&junior->robot, JUNIOR_PARAM_REFLEX_TURN);
    maneuver_wheels(junior, junior->maneuver.turn_left ? JUNIOR_ACTION_L : JUNIOR_ACTION_R);
}

/* True when the reflex took over. Seen by both sides, or by the left: turn right. */
bool reflex_begin(struct junior *junior)
{
    uint8_t off_ring = sensing_off_ring(junior);
    int16_t speed = (int16_t)-params_get(&junior->robot, JUNIOR_PARAM_REFLEX_SPEED);

    if (off_ring == 0) {
        return false;
    }
    junior->maneuver.turn_left = off_ring == 1U << RIGHT;
    junior->maneuver.phase = PHASE_BACKING;
    junior->maneuver.phase_end = junior->robot.time.now + (uint32_t)params_get(&junior->robot, JUNIOR_PARAM_REFLEX_BACK);
    driving_set(junior, speed, speed);
    reflex_step(junior);
    return true;
}

void reflex_step(struct junior *junior)
{
    if (junior->maneuver.phase == PHASE_BACKING && time_due(&junior->robot, junior->maneuver.phase_end)) {
        turn(junior);
    }
    if (junior->maneuver.phase == PHASE_TURNING && time_due(&junior->robot, junior->maneuver.phase_end)) {
        maneuver_conclude(junior, JUNIOR_OUTCOME_FLOOR_REFLEX);
    }
}
