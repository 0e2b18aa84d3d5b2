/* Contest: autonomous play from memory, with no host at all. */
#include "core.h"

enum { SUMO_COUNTDOWN = 5000 /* ms */, SEARCH_PERIOD = 250 /* ms */, EYES = 3 };

void contest_start(struct junior *robot)
{
    robot->contest.start_input = hal_start(robot->board) != 0; /* on at power-on is no start */
}

uint8_t contest_begin(struct junior *robot, uint16_t countdown)
{
    uint8_t reason;

    if (robot->memory.used == 0) {
        return ROBOT_REASON_NOT_FOUND;
    }
    reason = states_fire(robot, EVENT_CONTEST, ROBOT_REASON_BY_COMMAND);
    if (reason == ROBOT_REASON_NONE) {
        robot->contest.begins = robot->time.now + countdown;
    }
    return reason;
}

/* What memory says to (previous, current); else to current, whatever came before; else to what the eyes see of it;
 * else: look around. */
static void choose(struct junior *robot, struct maneuver_plan *plan)
{
    uint8_t current = sensing_stimulus(robot);
    uint8_t slot;

    if (params_get(robot, PARAM_STIM_ARMS) == 0) {
        current &= EYES;
    }
    slot = memory_find(robot, robot->contest.previous, current);
    if (slot == MEMORY_NONE) {
        slot = memory_find(robot, ANY_STIMULUS, current);
    }
    if (slot == MEMORY_NONE) {
        slot = memory_find(robot, ANY_STIMULUS, current & EYES);
    }
    robot->contest.previous = current;
    if (slot == MEMORY_NONE || !memory_plan(robot, slot, plan)) {
        memset(plan, 0, sizeof *plan);
        plan->period = SEARCH_PERIOD;
        plan->options = JUNIOR_MANEUVER_OPTION_END_ON_CHANGE | JUNIOR_MANEUVER_OPTION_EYES;
        plan->count = 1;
        plan->actions[0] = JUNIOR_ACTION_L;
    }
    plan->options |= JUNIOR_MANEUVER_OPTION_FLOOR_REFLEX;
}

static bool time_over(const struct junior *robot)
{
    uint32_t longest = (uint32_t)params_get(robot, PARAM_CONTEST_MAX) * 1000U;

    return longest != 0 && robot->time.now - robot->contest.begins >= longest;
}

void contest_step(struct junior *robot)
{
    struct maneuver_plan plan;

    if (robot->state == ROBOT_STATE_COUNTDOWN && time_due(robot, robot->contest.begins)) {
        states_fire(robot, EVENT_GO, ROBOT_REASON_NONE);
        robot->contest.previous = 0;
    }
    if (robot->state != ROBOT_STATE_CONTEST) {
        return;
    }
    if (time_over(robot)) {
        states_fire(robot, EVENT_CONTEST_STOP, ROBOT_REASON_NONE);
    } else if (robot->maneuver.phase == PHASE_IDLE) {
        choose(robot, &plan);
        maneuver_begin(robot, &plan, false, 0);
    }
}

/* The start module: go arms and begins the countdown, stop disarms. Neither ends an e-stop. */
void contest_input(struct junior *robot)
{
    uint8_t input = hal_start(robot->board) != 0;

    if (input == robot->contest.start_input) {
        return;
    }
    robot->contest.start_input = input;
    if (input != 0) {
        if (robot->memory.used > 0 && states_fire(robot, EVENT_ARM, ROBOT_REASON_NONE) == ROBOT_REASON_NONE) {
            contest_begin(robot, SUMO_COUNTDOWN);
        }
    } else if (states_armed(robot)) {
        states_fire(robot, EVENT_DISARM, ROBOT_REASON_DISARMED);
    }
}
