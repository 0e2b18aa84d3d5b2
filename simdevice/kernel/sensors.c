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

void world_forget(kernel_world *world, uint32_t piece)
{
    uint32_t pair;

    for (pair = piece * world->pieces; pair < (piece + 1) * world->pieces; pair++) {
        world->seen_x[pair] = world->seen_y[pair] = INFINITY;
        world->seen_cos[pair] = world->seen_sin[pair] = 0.0;
    }
    world->arm[2 * piece] = world->arm[2 * piece + 1] = 0;
    world->distance[2 * piece] = world->distance[2 * piece + 1] = INFINITY;
}

/* Distances of the eyes; the robot is at (x, y) in the frame of the other, with its heading's cosine and sine there. */
static void look(
    const kernel_profile *profile, const kernel_outline *outline, double x, double y, double c, double s, double *distance)
{
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

/* Measures another piece. Returns 0 where it is as it was: at rest, or pushing. */
static uint8_t measure_one(kernel_world *world, uint32_t piece, uint32_t other, uint32_t pair)
{
    const kernel_profile *profile = world->profile[piece];
    const kernel_outline *outline = world->outline[other];
    double dx = world->x[piece] - world->x[other], dy = world->y[piece] - world->y[other];
    double turn_cos = world->cos[other], turn_sin = world->sin[other];
    double x = dx * turn_cos + dy * turn_sin, y = dy * turn_cos - dx * turn_sin;
    double c = world->cos[piece] * turn_cos + world->sin[piece] * turn_sin;
    double s = world->sin[piece] * turn_cos - world->cos[piece] * turn_sin;
    double *seen = &world->seen[2 * pair], *gap = &world->gap[2 * pair], ahead;

    if (within(x - world->seen_x[pair], STILL) && within(y - world->seen_y[pair], STILL) &&
        within(c - world->seen_cos[pair], STEADY) && within(s - world->seen_sin[pair], STEADY)) {
        return 0;
    }
    world->seen_x[pair] = x;
    world->seen_y[pair] = y;
    world->seen_cos[pair] = c;
    world->seen_sin[pair] = s;
    ahead = -(x * c + y * s);
    seen[0] = seen[1] = gap[0] = gap[1] = INFINITY;
    if (ahead < -outline->radius) { /* wholly behind the axle: out of sight and of reach */
        return 1;
    }
    look(profile, outline, x, y, c, s, seen);
    if (ahead - outline->radius <= profile->release) {
        outline_gaps(outline, x, y, c, s, profile->arm_span, gap);
    }
    return 1;
}

static void measure(kernel_world *world, uint32_t piece)
{
    const kernel_profile *profile = world->profile[piece];
    uint32_t first = piece - piece % world->pieces, pair = piece * world->pieces, k;
    uint8_t *arm = &world->arm[2 * piece], changed = 0, touched;
    double *distance = &world->distance[2 * piece], bound;
    int side;

    for (k = 0; k < world->pieces; k++) {
        if (first + k != piece) {
            changed |= measure_one(world, piece, first + k, pair + k);
        }
    }
    if (!changed) {
        return;
    }
    for (side = 0; side < 2; side++) {
        bound = arm[side] ? profile->release : profile->press;
        distance[side] = INFINITY;
        touched = 0;
        for (k = 0; k < world->pieces; k++) {
            if (first + k != piece) {
                double gap = world->gap[2 * (pair + k) + (uint32_t)side];

                distance[side] = least(distance[side], world->seen[2 * (pair + k) + (uint32_t)side]);
                touched |= profile->behind < gap && gap <= bound;
            }
        }
        arm[side] = touched;
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
    const kernel_profile *profile = world->profile[piece];
    double c = world->cos[piece], s = world->sin[piece];
    double x = world->x[piece] + profile->floor_x * c - side * s, y = world->y[piece] + profile->floor_x * s + side * c;
    double clearance = least(world->half_x - fabs(x), world->half_y - fabs(y));
    double share = most(0.0, least(1.0, 0.5 - clearance / profile->floor_spot));
    double read = count + share * profile->floor_step;

    return read < ADC_MAX ? (uint16_t)read : ADC_MAX;
}

void world_sense(kernel_world *world, uint32_t piece, uint8_t held_up)
{
    const kernel_profile *profile = world->profile[piece];
    uint32_t at = world->reading_at[piece]++, count = world->readings[piece];
    const double *eye = world->eye_noise[piece];
    const uint16_t *floor = world->floor_noise[piece];
    uint16_t left = floor[at], right = floor[count + at];

    if (held_up) {
        world_forget(world, piece);
    } else {
        measure(world, piece);
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
