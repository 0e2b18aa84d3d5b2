/* The fence: a rectangle about the origin, for the robot's centre. */
#include "micro/modules.h"

enum { LOOK_AHEAD_MM = 10, SWING = 5461 /* 30 degrees: a heading swings about the way */ };
#define EXCESS_MOST 46340L /* whose square, and twice it, 32 bits hold */

static int32_t excess(const struct micro *micro, uint8_t param, int32_t um)
{
    int32_t half = micro_milli(micro, param);
    int32_t over;

    if (half == 0) {
        return 0;
    }
    over = (um < 0 ? -um : um) / UM_PER_MM - half;
    return over < 0 ? 0 : over > EXCESS_MOST ? EXCESS_MOST : over;
}

/* Square of the distance by which a place is outside, mm. */
static uint32_t outside(const struct micro *micro, int32_t x, int32_t y)
{
    uint32_t across = (uint32_t)excess(micro, MICRO_PARAM_FENCE_X, x), up = (uint32_t)excess(micro, MICRO_PARAM_FENCE_Y, y);

    return across * across + up * up;
}

static uint32_t outside_there(const struct micro *micro, uint16_t way, uint16_t distance)
{
    int32_t um = (int32_t)distance * UM_PER_MM;

    return outside(micro, micro->pose.x + angles_scale(um, angles_cosine(way)), micro->pose.y + angles_scale(um, angles_sine(way)));
}

bool fence_there(const struct micro *micro)
{
    return micro_milli(micro, MICRO_PARAM_FENCE_X) != 0 || micro_milli(micro, MICRO_PARAM_FENCE_Y) != 0;
}

bool fence_leaves(const struct micro *micro, uint16_t way, uint16_t distance)
{
    uint32_t there = outside_there(micro, way, distance);

    return there > 0 && there >= outside(micro, micro->pose.x, micro->pose.y);
}

bool fence_crossed(const struct micro *micro, uint16_t way, uint16_t heading)
{
    uint32_t here = outside(micro, micro->pose.x, micro->pose.y);

    return here > 0
           && (outside_there(micro, way, LOOK_AHEAD_MM) > here
               || (angles_size((uint16_t)(heading - way)) > SWING && outside_there(micro, heading, LOOK_AHEAD_MM) > here));
}
