/* The arithmetic is that of simdevice/junior/sensors.py, operation by operation, and is to stay so. */
#include <math.h>

#include "order.h"
#include "world.h"

static const double STILL = 2e-5;  /* m */
static const double STEADY = 2e-4; /* rad */
static const uint16_t ADC_MAX = 1023;

static uint8_t within(double difference, double bound)
{
    return -bound < difference && difference < bound;
}

static void forget(kernel_world *world, uint32_t piece)
{
    world->seen_x[piece] = world->seen_y[piece] = INFINITY;
    world->seen_cos[piece] = world->seen_sin[piece] = 0.0;
    world->arm[2 * piece] = world->arm[2 * piece + 1] = 0;
    world->distance[2 * piece] = world->distance[2 * piece + 1] = INFINITY;
}

/* Distances of the eyes; the robot is at (x, y) in the frame of the other, with its heading's cosine and sine there. */
static void look(kernel_world *world, uint32_t piece, const kernel_outline *outline, double x, double y, double c, double s)
{
    const kernel_profile *profile = &world->profile;
    double *distance = &world->distance[2 * piece];
    double eye_x = x + c * profile->eye_x, eye_y = y + s * profile->eye_x, farthest = profile->reach + outline->radius;
    double side_x, side_y, cone[4], left, right;
    double outer_cos = profile->cone[0], outer_sin = profile->cone[1];
    double inner_cos = profile->cone[2], inner_sin = profile->cone[3];

    if (!(eye_x * eye_x + eye_y * eye_y < farthest * farthest)) {
        return;
    }
    side_x = -s * profile->eye_y;
    side_y = c * profile->eye_y;
    cone[0] = c * outer_cos - s * outer_sin;
    cone[1] = s * outer_cos + c * outer_sin;
    cone[2] = c * inner_cos - s * inner_sin;
    cone[3] = s * inner_cos + c * inner_sin;
    left = outline_nearest_seen(outline, eye_x + side_x, eye_y + side_y, cone, profile->steepest);
    cone[0] = c * inner_cos + s * inner_sin;
    cone[1] = s * inner_cos - c * inner_sin;
    cone[2] = c * outer_cos + s * outer_sin;
    cone[3] = s * outer_cos - c * outer_sin;
    right = outline_nearest_seen(outline, eye_x - side_x, eye_y - side_y, cone, profile->steepest);
    if (left <= profile->reach) {
        distance[0] = left;
    }
    if (right <= profile->reach) {
        distance[1] = right;
    }
}

static void measure(kernel_world *world, uint32_t piece, uint32_t other)
{
    const kernel_profile *profile = &world->profile;
    const kernel_outline *outline = world->outline[other];
    double dx = world->x[piece] - world->x[other], dy = world->y[piece] - world->y[other];
    double turn_cos = world->cos[other], turn_sin = world->sin[other];
    double x = dx * turn_cos + dy * turn_sin, y = dy * turn_cos - dx * turn_sin;
    double c = world->cos[piece] * turn_cos + world->sin[piece] * turn_sin;
    double s = world->sin[piece] * turn_cos - world->cos[piece] * turn_sin;
    uint8_t *arm = &world->arm[2 * piece];
    double ahead, gaps[2];
    int side;

    if (within(x - world->seen_x[piece], STILL) && within(y - world->seen_y[piece], STILL) &&
        within(c - world->seen_cos[piece], STEADY) && within(s - world->seen_sin[piece], STEADY)) {
        return; /* as it was: at rest, or pushing */
    }
    world->seen_x[piece] = x;
    world->seen_y[piece] = y;
    world->seen_cos[piece] = c;
    world->seen_sin[piece] = s;
    ahead = -(x * c + y * s);
    world->distance[2 * piece] = world->distance[2 * piece + 1] = INFINITY;
    if (ahead < -outline->radius) { /* wholly behind the axle: out of sight and of reach */
        arm[0] = arm[1] = 0;
        return;
    }
    look(world, piece, outline, x, y, c, s);
    if (ahead - outline->radius > profile->release) {
        arm[0] = arm[1] = 0;
        return;
    }
    outline_gaps(outline, x, y, c, s, profile->arm_span, gaps);
    for (side = 0; side < 2; side++) {
        arm[side] = profile->behind < gaps[side] && gaps[side] <= (arm[side] ? profile->release : profile->press);
    }
}

static uint16_t eye_count(const kernel_profile *profile, double count, double distance)
{
    if (distance < INFINITY) {
        count += profile->eye_scale / (distance + profile->eye_offset);
    }
    return count < ADC_MAX ? (uint16_t)count : ADC_MAX;
}

static uint16_t floor_count(const kernel_world *world, uint32_t piece, uint16_t count, double side)
{
    const kernel_profile *profile = &world->profile;
    double c = world->cos[piece], s = world->sin[piece];
    double x = world->x[piece] + profile->floor_x * c - side * s, y = world->y[piece] + profile->floor_x * s + side * c;
    double clearance = least(world->half_x - fabs(x), world->half_y - fabs(y));
    double share = most(0.0, least(1.0, 0.5 - clearance / profile->floor_spot));
    double read = count + share * profile->floor_step;

    return read < ADC_MAX ? (uint16_t)read : ADC_MAX;
}

void world_sense(kernel_world *world, uint32_t piece, uint32_t other, uint8_t held_up)
{
    const kernel_profile *profile = &world->profile;
    uint32_t at = world->reading_at[piece]++, count = world->readings[piece];
    const double *eye = world->eye_noise[piece];
    const uint16_t *floor = world->floor_noise[piece];
    uint16_t left = floor[at], right = floor[count + at];

    if (held_up) {
        forget(world, piece);
    } else {
        measure(world, piece, other);
    }
    world->eye[2 * piece] = eye_count(profile, eye[at], world->distance[2 * piece]);
    world->eye[2 * piece + 1] = eye_count(profile, eye[count + at], world->distance[2 * piece + 1]);
    if (fabs(world->x[piece]) > profile->floor_beyond_x || fabs(world->y[piece]) > profile->floor_beyond_y) {
        left = floor_count(world, piece, left, profile->floor_y);
        right = floor_count(world, piece, right, -profile->floor_y);
    }
    world->floor[2 * piece] = left;
    world->floor[2 * piece + 1] = right;
}
