/* A maneuver: actions timed on board, and what was counted while they were performed.
 *
 * An action begun in one tick is sampled in the ticks that follow, up to and including the one that ends it: what the
 * sensors say in a tick is the effect of the wheels since the tick before. So 250 ms are 50 samples of 5 ms.
 */
#include "junior/modules.h"

enum {
    SHORTEST_PERIOD = 20,  /* ms */
    LONGEST_PERIOD = 5000, /* ms */
    STEADY_MS = 20,        /* a stimulus must differ this long to end a maneuver: a flicker does not */
    REPEAT_MS = 100,       /* of a result that nobody has acknowledged */
    NO_ODOMETER = -32768,
    TRAVEL_LIMIT = 32000, /* mm */
};

struct action_row {
    uint8_t speed;
    int8_t left, right;
};

#define ROW(name, code, family, speed, left, right) {speed, left, right},
static const struct action_row actions[ACTION_COUNT] HAL_FLASH = {ACTION_TABLE(ROW)};
#undef ROW

static int16_t action_speed(const struct junior *junior, uint8_t action)
{
    switch (flash_u8(&actions[action].speed)) {
    case ACTION_SPEED_FAST:
        return params_get(&junior->robot, JUNIOR_PARAM_SPD_FAST);
    case ACTION_SPEED_MODERATE:
        return params_get(&junior->robot, JUNIOR_PARAM_SPD_MODERATE);
    case ACTION_SPEED_SLOW:
        return params_get(&junior->robot, JUNIOR_PARAM_SPD_SLOW);
    case ACTION_SPEED_TURN:
        return params_get(&junior->robot, JUNIOR_PARAM_SPD_TURN);
    default:
        return 0;
    }
}

void maneuver_wheels(struct junior *junior, uint8_t action)
{
    int16_t speed = action_speed(junior, action);

    driving_set(junior, (int16_t)((int8_t)flash_u8(&actions[action].left) * speed),
                (int16_t)((int8_t)flash_u8(&actions[action].right) * speed));
}

bool maneuver_valid(const struct maneuver_plan *plan)
{
    uint8_t i;

    if (plan->count < 1 || plan->count > MAX_ACTIONS || plan->period < SHORTEST_PERIOD || plan->period > LONGEST_PERIOD
        || plan->options > MANEUVER_OPTIONS) {
        return false;
    }
    for (i = 0; i < MAX_ACTIONS; i++) {
        if (plan->actions[i] >= ACTION_COUNT) {
            return false;
        }
    }
    return true;
}

/* Takes a plan from the fields of a message. */
bool maneuver_read(struct maneuver_plan *plan, uint16_t period, uint16_t options, uint8_t count, const uint8_t *codes)
{
    plan->period = period;
    plan->options = (uint8_t)(options > MANEUVER_OPTIONS ? 255 : options);
    plan->count = count;
    memcpy(plan->actions, codes, MAX_ACTIONS);
    return maneuver_valid(plan);
}

/* The caller has put the robot into PERFORMING or CONTEST. */
void maneuver_begin(struct junior *junior, const struct maneuver_plan *plan, bool reported, uint16_t sequence)
{
    struct maneuver *maneuver = &junior->maneuver;
    uint8_t i;

    memset(&maneuver->result, 0, sizeof maneuver->result);
    maneuver->result.session = junior->robot.session.id;
    maneuver->result.target_system = junior->robot.session.owner.system;
    maneuver->result.target_component = junior->robot.session.owner.component;
    maneuver->result.sequence = sequence;
    maneuver->result.stimulus_before = sensing_stimulus(junior);
    if (!(junior->sensing.flags & JUNIOR_SENSOR_FLAG_GROUND_ODOMETER)) {
        for (i = 0; i < MAX_ACTIONS; i++) {
            maneuver->result.travel[i] = NO_ODOMETER;
        }
    }
    maneuver->plan = *plan;
    maneuver->phase = PHASE_ACTING;
    maneuver->index = 0;
    maneuver->reported = reported;
    maneuver->result_pending = false;
    maneuver->changing = false;
    maneuver->phase_end = junior->robot.time.now + plan->period;
    maneuver->pressed_um = 0;
    maneuver->press[LEFT] = 0;
    maneuver->press[RIGHT] = 0;
    junior->robot.counters.maneuvers++;
    maneuver_wheels(junior, plan->actions[0]);
}

static void count_press(struct junior *junior, uint8_t side, uint16_t *longest, uint8_t *edges)
{
    struct maneuver *maneuver = &junior->maneuver;

    if (junior->sensing.edges & (1U << side) && *edges < 255) {
        (*edges)++;
    }
    if (junior->sensing.flags & (JUNIOR_SENSOR_FLAG_ARM_LEFT << side)) {
        maneuver->press[side] = (uint16_t)(maneuver->press[side] + junior->robot.time.elapsed);
        if (maneuver->press[side] > *longest) {
            *longest = maneuver->press[side];
        }
    } else {
        maneuver->press[side] = 0;
    }
}

static void sample(struct junior *junior)
{
    struct maneuver *maneuver = &junior->maneuver;
    mavlink_junior_maneuver_result_t *result = &maneuver->result;
    uint8_t i = maneuver->index;
    int32_t mm;

    result->samples[i]++;
    if (junior->sensing.flags & JUNIOR_SENSOR_FLAG_EYE_LEFT) {
        result->eye_left[i]++;
    }
    if (junior->sensing.flags & JUNIOR_SENSOR_FLAG_EYE_RIGHT) {
        result->eye_right[i]++;
    }
    count_press(junior, LEFT, &result->press_left[i], &result->edges_left[i]);
    count_press(junior, RIGHT, &result->press_right[i], &result->edges_right[i]);
    if (junior->sensing.flags & JUNIOR_SENSOR_FLAG_GROUND_ODOMETER
        && junior->sensing.flags & (JUNIOR_SENSOR_FLAG_ARM_LEFT | JUNIOR_SENSOR_FLAG_ARM_RIGHT)) {
        mm = junior->sensing.ground_moved;
        if (mm > -100000L && mm < 100000L) { /* 100 mm in a tick are a fault of the sensor */
            maneuver->pressed_um += mm;
        }
        mm = (maneuver->pressed_um + (maneuver->pressed_um < 0 ? -500 : 500)) / 1000;
        result->travel[i] = (int16_t)(mm < -TRAVEL_LIMIT ? -TRAVEL_LIMIT : mm > TRAVEL_LIMIT ? TRAVEL_LIMIT : mm);
    }
}

static bool stimulus_changed(struct junior *junior)
{
    struct maneuver *maneuver = &junior->maneuver;
    uint8_t counts = (uint8_t)((maneuver->plan.options & JUNIOR_MANEUVER_OPTION_EYES ? 3 : 0)
                               | (maneuver->plan.options & JUNIOR_MANEUVER_OPTION_ARMS ? 12 : 0));

    if (!(maneuver->plan.options & JUNIOR_MANEUVER_OPTION_END_ON_CHANGE)) {
        return false;
    }
    if (((sensing_stimulus(junior) ^ maneuver->result.stimulus_before) & counts) == 0) {
        maneuver->changing = false;
        return false;
    }
    if (!maneuver->changing) {
        maneuver->changing = true;
        maneuver->changing_since = junior->robot.time.now;
    }
    return junior->robot.time.now - maneuver->changing_since >= STEADY_MS;
}

static void next_action(struct junior *junior)
{
    struct maneuver *maneuver = &junior->maneuver;

    maneuver->result.done++;
    if (++maneuver->index >= maneuver->plan.count) {
        maneuver_conclude(junior, JUNIOR_OUTCOME_COMPLETED);
        return;
    }
    maneuver->phase_end += maneuver->plan.period;
    maneuver->pressed_um = 0;
    maneuver->press[LEFT] = 0;
    maneuver->press[RIGHT] = 0;
    maneuver_wheels(junior, maneuver->plan.actions[maneuver->index]);
}

void maneuver_step(struct junior *junior)
{
    struct maneuver *maneuver = &junior->maneuver;

    if (maneuver->phase == PHASE_BACKING || maneuver->phase == PHASE_TURNING) {
        reflex_step(junior);
        return;
    }
    if (maneuver->phase != PHASE_ACTING) {
        return;
    }
    sample(junior);
    if (maneuver->plan.options & JUNIOR_MANEUVER_OPTION_FLOOR_REFLEX && reflex_begin(junior)) {
        return;
    }
    if (time_due(&junior->robot, maneuver->phase_end)) {
        next_action(junior);
    } else if (stimulus_changed(junior)) {
        maneuver_conclude(junior, JUNIOR_OUTCOME_STIMULUS_CHANGED);
    }
}

void maneuver_end(struct junior *junior, uint8_t outcome, uint8_t reason)
{
    struct maneuver *maneuver = &junior->maneuver;

    maneuver->phase = PHASE_IDLE;
    maneuver->result.outcome = outcome;
    maneuver->result.reason = reason;
    maneuver->result.stimulus_after = sensing_stimulus(junior);
    maneuver->result_pending = maneuver->reported;
    maneuver->result_due = junior->robot.time.now;
    if (outcome == JUNIOR_OUTCOME_REPLACED) {
        maneuver_report(junior); /* its one chance: the next one takes its place */
    }
}

void maneuver_conclude(struct junior *junior, uint8_t outcome)
{
    uint8_t options = junior->maneuver.plan.options;
    bool holds = options & JUNIOR_MANEUVER_OPTION_HOLD && outcome != JUNIOR_OUTCOME_FLOOR_REFLEX;

    maneuver_end(junior, outcome, ROBOT_REASON_NONE);
    /* A contest is not left for either: there the next maneuver begins in this very tick. */
    states_fire(&junior->robot, holds ? EVENT_DRIVE : EVENT_DONE, ROBOT_REASON_NONE);
    driving_run(junior, (uint16_t)params_get(&junior->robot, JUNIOR_PARAM_MAN_HOLD),
                options & JUNIOR_MANEUVER_OPTION_FLOOR_REFLEX);
}

/* Sends the result until somebody acknowledges it. */
void maneuver_report(struct junior *junior)
{
    struct maneuver *maneuver = &junior->maneuver;

    if (maneuver->result_pending && time_due(&junior->robot, maneuver->result_due)
        && SEND(&junior->robot, JUNIOR_MANEUVER_RESULT, &maneuver->result)) {
        maneuver->result_due = junior->robot.time.now + REPEAT_MS;
    }
}
