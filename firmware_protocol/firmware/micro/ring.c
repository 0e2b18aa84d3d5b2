/* The ring of sensors: how it is read, and what is made of it. */
#include "micro/modules.h"

enum { SECTORS_MOST = 16, RANGES_MOST = 32 };

/* What SWARM_SENSE has said; before that, the parameters. */
const struct ring_setting *ring_setting(struct micro *micro)
{
    struct ring_setting *setting = &micro->ring.setting;

    if (!micro->ring.told) {
        setting->radius = micro_milli(micro, MICRO_PARAM_SENSE_R0);
        setting->increment = micro_milli(micro, MICRO_PARAM_SENSE_DR);
        setting->limit = micro_milli(micro, MICRO_PARAM_SENSE_LIMIT);
        setting->sectors = (uint8_t)params_get(&micro->robot, MICRO_PARAM_SECTORS);
        setting->ranges = (uint8_t)params_get(&micro->robot, MICRO_PARAM_RANGES);
    }
    return setting;
}

uint8_t ring_sense(struct micro *micro, const mavlink_swarm_sense_t *request)
{
    struct ring_setting *setting = &micro->ring.setting;

    if (request->sectors == 0 || request->sectors > SECTORS_MOST || request->ranges > RANGES_MOST) {
        return ROBOT_REASON_BAD_VALUE;
    }
    micro->ring.told = true;
    setting->radius = request->radius;
    setting->increment = request->increment;
    setting->limit = request->limit;
    setting->sectors = request->sectors;
    setting->ranges = request->ranges;
    return ROBOT_REASON_NONE;
}

bool ring_fitted(const struct micro *micro)
{
    return params_get(&micro->robot, MICRO_PARAM_RING) != 0;
}

void ring_start(struct micro *micro)
{
#if MICRO_RING
    uint8_t fitted = hal_has_ring(micro->robot.board);
#else
    uint8_t fitted = 0;
#endif

    micro->robot.params.value[MICRO_PARAM_RING] = fitted;
    micro->robot.params.integer[MICRO_PARAM_RING] = fitted;
    micro->ring.before = ring_setting(micro)->radius;
}

#if MICRO_RING

enum { MOST_COUNTED = 255 };

void ring_ask(struct micro *micro)
{
    const struct ring_setting *setting = ring_setting(micro);
    struct hal_ring wanted;

    if (micro->ring.busy) {
        return; /* it comes in the next period, whoever has asked */
    }
    wanted.least = setting->radius > micro->ring.before ? setting->radius : micro->ring.before;
    wanted.step = setting->increment;
    wanted.limit = setting->limit;
    wanted.ranges = setting->ranges;
    wanted.farthest = micro_milli(micro, MICRO_PARAM_RANGE_MAX);
    hal_ring_start(micro->robot.board, &wanted);
    micro->ring.busy = true;
}

static bool inside(uint32_t distance, uint16_t radius)
{
    return radius == LENGTH_NONE || distance < (uint32_t)radius * UM_PER_MM;
}

/* R0, and as many increments as bring the nearest of another class in; where the limit does not allow that, all it allows. */
static uint16_t grown(const struct ring_setting *setting, uint32_t nearest)
{
    uint32_t least = (uint32_t)setting->radius * UM_PER_MM, steps, most;

    if (setting->increment == 0 || inside(nearest, setting->radius)) {
        return setting->radius;
    }
    if (nearest == UINT32_MAX && setting->limit == LENGTH_NONE) {
        return LENGTH_NONE;
    }
    steps = (nearest - least) / ((uint32_t)setting->increment * UM_PER_MM) + 1U;
    if (setting->limit != LENGTH_NONE) {
        most = setting->limit > setting->radius ? (uint32_t)(setting->limit - setting->radius) / setting->increment : 0;
        steps = steps > most ? most : steps;
    }
    least = setting->radius + steps * setting->increment;
    return least > LENGTH_NONE ? LENGTH_NONE : (uint16_t)least;
}

static void count(uint8_t *counter)
{
    if (*counter < MOST_COUNTED) {
        (*counter)++;
    }
}

static void take(struct micro *micro)
{
    const struct ring_setting *setting = ring_setting(micro);
    struct reading *reading = &micro->ring.reading;
    uint8_t group = (uint8_t)params_get(&micro->robot, MICRO_PARAM_CLASS);
    uint32_t nearest = UINT32_MAX;
    struct hal_neighbour other;
    uint16_t i, bit;

    for (i = 0; hal_neighbour(micro->robot.board, i, &other); i++) {
        if (other.group != group && other.distance < nearest) {
            nearest = other.distance;
        }
    }
    memset(reading, 0, sizeof *reading);
    reading->radius = grown(setting, nearest);
    reading->radius_before = micro->ring.before;
    for (i = 0; hal_neighbour(micro->robot.board, i, &other); i++) {
        group = other.group != 0;
        bit = (uint16_t)(1U << (setting->sectors - 1U - ((uint32_t)other.bearing * setting->sectors >> 16)));
        if (inside(other.distance, setting->radius)) {
            reading->near[group] |= bit;
        }
        if (inside(other.distance, reading->radius)) {
            reading->seen[group] |= bit;
            count(&reading->count[group]);
        }
        if (inside(other.distance, reading->radius_before)) {
            count(&reading->count_before[group]);
        }
    }
}

void ring_step(struct micro *micro)
{
    if (micro->ring.busy && hal_ring_ready(micro->robot.board)) {
        micro->ring.busy = false;
        if (ring_fitted(micro)) {
            take(micro);
        }
    }
}

#else

/* It takes a period here, too: whoever asks is answered when a robot with a ring would answer. */
void ring_ask(struct micro *micro)
{
    micro->ring.busy = true;
}

void ring_step(struct micro *micro)
{
    micro->ring.busy = false;
}

#endif
