/* Contest: autonomous play from memory, with no host at all. */
#include "junior/modules.h"

enum { SUMO_COUNTDOWN = 5000 /* ms */, SEARCH_PERIOD = 250 /* ms */, EYES = 3 };

void contest_start(struct junior *junior)
{
    junior->contest.start_input = hal_start(junior->robot.board) != 0; /* on at power-on is no start */
}

uint8_t contest_begin(struct junior *junior, uint16_t countdown)
{
    uint8_t reason;

    if (junior->memory.used == 0) {
        return ROBOT_REASON_NOT_FOUND;
    }
    reason = states_fire(&junior->robot, EVENT_CONTEST, ROBOT_REASON_BY_COMMAND);
    if (reason == ROBOT_REASON_NONE) {
        junior->contest.begins = junior->robot.time.now + countdown;
    }
    return reason;
}

/* What memory says to (previous, current); else to current, whatever came before; else to what the eyes see of it;
 * else: look around. */
static void choose(struct junior *junior, struct maneuver_plan *plan)
{
    uint8_t current = sensing_stimulus(junior);
    uint8_t slot;

    if (params_get(&junior->robot, JUNIOR_PARAM_STIM_ARMS) == 0) {
        current &= EYES;
    }
    slot = memory_find(junior, junior->contest.previous, current);
    if (slot == MEMORY_NONE) {
        slot = memory_find(junior, ANY_STIMULUS, current);
    }
    if (slot == MEMORY_NONE) {
        slot = memory_find(junior, ANY_STIMULUS, current & EYES);
    }
    junior->contest.previous = current;
    if (slot == MEMORY_NONE || !memory_plan(junior, slot, plan)) {
        memset(plan, 0, sizeof *plan);
        plan->period = SEARCH_PERIOD;
        plan->options = JUNIOR_MANEUVER_OPTION_END_ON_CHANGE | JUNIOR_MANEUVER_OPTION_EYES;
        plan->count = 1;
        plan->actions[0] = JUNIOR_ACTION_L;
    }
    plan->options |= JUNIOR_MANEUVER_OPTION_FLOOR_REFLEX;
}

static bool time_over(const struct junior *junior)
{
    uint32_t longest = (uint32_t)params_get(&junior->robot, JUNIOR_PARAM_CONTEST_MAX) * 1000U;

    return longest != 0 && junior->robot.time.now - junior->contest.begins >= longest;
}

void contest_step(struct junior *junior)
{
    struct maneuver_plan plan;

    if (junior->robot.state == ROBOT_STATE_COUNTDOWN && time_due(&junior->robot, junior->contest.begins)) {
        states_fire(&junior->robot, EVENT_GO, ROBOT_REASON_NONE);
        junior->contest.previous = 0;
    }
    if (junior->robot.state != ROBOT_STATE_CONTEST) {
        return;
    }
    if (time_over(junior)) {
        states_fire(&junior->robot, EVENT_CONTEST_STOP, ROBOT_REASON_NONE);
    } else if (junior->maneuver.phase == PHASE_IDLE) {
        choose(junior, &plan);
        maneuver_begin(junior, &plan, false, 0);
    }
}

/* The start module: go arms and begins the countdown, stop disarms. Neither ends an e-stop. */
void contest_input(struct junior *junior)
{
    uint8_t input = hal_start(junior->robot.board) != 0;

    if (input == junior->contest.start_input) {
        return;
    }
    junior->contest.start_input = input;
    if (input != 0) {
        if (junior->memory.used > 0 && states_fire(&junior->robot, EVENT_ARM, ROBOT_REASON_NONE) == ROBOT_REASON_NONE) {
            contest_begin(junior, SUMO_COUNTDOWN);
        }
    } else if (states_armed(&junior->robot)) {
        states_fire(&junior->robot, EVENT_DISARM, ROBOT_REASON_DISARMED);
    }
}
