/* The arithmetic is that of simdevice/outline.py, operation by operation, and is to stay so. */
#include "outline.h"

#include <math.h>

#include "order.h"

static const double PI = 3.14159265358979323846;

/* Angle at which the point of a disc at `angle` from the nearest one is seen from a distance. */
static double sight(double distance, double radius, double angle)
{
    double horizon = acos(radius / distance);

    angle = most(-horizon, least(horizon, angle));
    return atan2(radius * sin(angle), distance - radius * cos(angle));
}

static double arc_seen(const kernel_outline *outline, double x, double y, const double *cone, double tangent)
{
    double toward_x = outline->disc_x - x, toward_y = -y;
    double distance = sqrt(toward_x * toward_x + toward_y * toward_y), radius = outline->disc_radius;
    double high, low, widest, angle, offset;

    if (distance <= radius) {
        return INFINITY;
    }
    high = atan2(toward_x * cone[1] - toward_y * cone[0], toward_x * cone[0] + toward_y * cone[1]);
    low = atan2(toward_x * cone[3] - toward_y * cone[2], toward_x * cone[2] + toward_y * cone[3]);
    if (low > high) { /* the centre is behind the eye, where the angles wrap */
        return INFINITY;
    }
    widest = asin(radius * tangent / sqrt(1.0 + tangent * tangent) / distance);
    high = least(high, widest);
    low = most(low, -widest);
    if (outline->half_angle < PI) {
        double facing = atan2(-toward_y, -toward_x);

        high = least(high, sight(distance, radius, facing + outline->half_angle));
        low = most(low, sight(distance, radius, facing - outline->half_angle));
    }
    if (low > high) {
        return INFINITY;
    }
    angle = low > 0.0 ? low : least(high, 0.0);
    offset = distance * sin(angle);
    return distance * cos(angle) - sqrt(most(0.0, radius * radius - offset * offset));
}

double outline_nearest_seen(const kernel_outline *outline, double x, double y, const double *cone, double tangent)
{
    double lx = cone[0], ly = cone[1], rx = cone[2], ry = cone[3], best = INFINITY;
    uint32_t i;

    if (ly * x - lx * y > outline->radius || rx * y - ry * x > outline->radius) {
        return INFINITY; /* the whole body is beyond one border of the cone */
    }
    for (i = 0; i < outline->edges; i++) {
        const kernel_edge *edge = &outline->edge[i];
        double px = x - edge->x, py = y - edge->y, tx = edge->along_x, ty = edge->along_y;
        double height = px * ty - py * tx, ahead_left, ahead_right, high, low, foot, along;

        if (height <= 0.0) {
            continue;
        }
        ahead_left = ly * tx - lx * ty;
        ahead_right = ry * tx - rx * ty;
        if (ahead_left <= 0.0 && ahead_right <= 0.0) {
            continue;
        }
        /* Along the side, from the foot of the perpendicular: what reflects, what exists, what the cone holds. */
        high = height * tangent;
        low = -high;
        foot = px * tx + py * ty;
        low = most(low, -foot);
        high = least(high, edge->length - foot);
        if (ahead_left > 0.0) {
            low = most(low, height * (lx * tx + ly * ty) / ahead_left);
        }
        if (ahead_right > 0.0) {
            high = least(high, height * (rx * tx + ry * ty) / ahead_right);
        }
        if (low > high) {
            continue;
        }
        along = low > 0.0 ? low : least(0.0, high);
        best = least(best, height * height + along * along);
    }
    best = best < INFINITY ? sqrt(best) : INFINITY;
    return outline->has_disc ? least(best, arc_seen(outline, x, y, cone, tangent)) : best;
}

/* Where a line enters the outline: distance along it from (x, y), negative behind; infinite where it misses. */
static double along_line(const kernel_outline *outline, double x, double y, double fx, double fy)
{
    double enter = -INFINITY, leave = INFINITY;
    uint32_t i;

    for (i = 0; i < outline->edges; i++) {
        const kernel_edge *edge = &outline->edge[i];
        double height = (x - edge->x) * edge->along_y - (y - edge->y) * edge->along_x;
        double rate = fx * edge->along_y - fy * edge->along_x;

        if (rate < 0.0) {
            enter = most(enter, -height / rate);
        } else if (rate > 0.0) {
            leave = least(leave, -height / rate);
        } else if (height > 0.0) {
            return INFINITY;
        }
    }
    if (outline->has_disc) {
        double px = x - outline->disc_x, middle = -(px * fx + y * fy), offset = px * fy - y * fx, half;
        double square = outline->disc_radius * outline->disc_radius - offset * offset;

        if (square < 0.0) {
            return INFINITY;
        }
        half = sqrt(square);
        enter = most(enter, middle - half);
        leave = least(leave, middle + half);
    }
    return enter <= leave ? enter : INFINITY;
}

/* Forward distance of the point that comes first; *side: its lateral one. */
static double foremost(const kernel_outline *outline, double x, double y, double fx, double fy, double *side)
{
    double nearest = INFINITY;
    uint32_t i;

    *side = 0.0;
    if (outline->has_disc && fabs(atan2(-fy, -fx)) <= outline->half_angle) {
        double px = outline->disc_x - outline->disc_radius * fx - x, py = -outline->disc_radius * fy - y;

        *side = py * fx - px * fy;
        return px * fx + py * fy;
    }
    for (i = 0; i < outline->corners; i++) {
        double px = outline->corner_x[i] - x, py = outline->corner_y[i] - y, ahead = px * fx + py * fy;

        if (ahead < nearest) {
            nearest = ahead;
            *side = py * fx - px * fy;
        }
    }
    return nearest;
}

void outline_gaps(
    const kernel_outline *outline, double x, double y, double fx, double fy, const double *span, double *gaps)
{
    double side, near = span[0], far = span[1], left, right;
    double first = foremost(outline, x, y, fx, fy, &side);

    /* The outline is convex: what is nearest within a strip is the foremost point, or lies on the border next to it. */
    left = near <= side && side <= far ? side : side < near ? near : far;
    right = -far <= side && side <= -near ? side : side < -far ? -far : -near;
    gaps[0] = left == side ? first : along_line(outline, x - fy * left, y + fx * left, fx, fy);
    gaps[1] = right == side ? first : along_line(outline, x - fy * right, y + fx * right, fx, fy);
}
