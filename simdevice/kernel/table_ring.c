/* What a robot's ring reads when it is asked. */
#include <math.h>

#include "order.h"
#include "table.h"

static const double TURN = 6.283185307179586; /* a full one, in rad */
static const double ROUNDING = 2e-6;          /* m: who is told of a distance may round it to um before looking how far a ring grows */

/* The way along a ray from (x, y) in the direction (rx, ry) until it meets a disc; infinite where it does not, 0
 * within it. */
static double to_disc(double dx, double dy, double rx, double ry, double radius)
{
    double along = dx * rx + dy * ry, outside = dx * dx + dy * dy - radius * radius, square = along * along - outside;

    if (outside <= 0.0) {
        return 0.0;
    }
    return along < 0.0 || square < 0.0 ? INFINITY : along - sqrt(square);
}

/* Likewise until it meets a segment. */
static double to_wall(const double *end, double x, double y, double rx, double ry)
{
    double along_x = end[2] - end[0], along_y = end[3] - end[1], px = end[0] - x, py = end[1] - y;
    double across = rx * along_y - ry * along_x, way, share;

    if (across == 0.0) {
        return INFINITY;
    }
    way = (px * along_y - py * along_x) / across;
    share = (px * ry - py * rx) / across;
    return way >= 0.0 && share >= 0.0 && share <= 1.0 ? way : INFINITY;
}

/* Likewise until it meets the box. */
static double to_box(const kernel_table *table, double x, double y, double rx, double ry)
{
    double half = table->box_half, c = table->box_cos, s = table->box_sin, dx, dy, place[2], heading[2], enter = 0.0, leave = INFINITY;
    int axis;

    if (table->box_kind == TABLE_CYLINDER) {
        return to_disc(table->box_x - x, table->box_y - y, rx, ry, half);
    }
    dx = x - table->box_x;
    dy = y - table->box_y;
    place[0] = dx * c + dy * s; /* in the box's frame */
    place[1] = dy * c - dx * s;
    heading[0] = rx * c + ry * s;
    heading[1] = ry * c - rx * s;
    for (axis = 0; axis < 2; axis++) {
        double one, other;

        if (heading[axis] == 0.0) {
            if (fabs(place[axis]) > half) {
                return INFINITY;
            }
            continue;
        }
        one = (-half - place[axis]) / heading[axis];
        other = (half - place[axis]) / heading[axis];
        enter = most(enter, least(one, other));
        leave = least(leave, most(one, other));
    }
    return enter <= leave ? enter : INFINITY;
}

/* Something stands on the straight line to a robot. */
static uint8_t hidden(const kernel_table *table, uint32_t row, uint32_t other, double distance)
{
    double x = table->x[row], y = table->y[row], rx, ry;
    uint32_t at;

    if (!(distance > 0.0)) {
        return 0;
    }
    rx = (table->x[other] - x) / distance;
    ry = (table->y[other] - y) / distance;
    for (at = 0; at < table->near; at++) {
        uint32_t between = table->near_row[at];
        double dx = table->x[between] - x, dy = table->y[between] - y;

        if (between != other && dx * dx + dy * dy < distance * distance &&
            to_disc(dx, dy, rx, ry, table->profile.radius) < distance) {
            return 1;
        }
    }
    for (at = 0; at < table->walls; at++) {
        if (to_wall(table->wall + 4 * at, x, y, rx, ry) < distance) {
            return 1;
        }
    }
    return table->box_kind != TABLE_NO_BOX && to_box(table, x, y, rx, ry) < distance;
}

void table_ring(kernel_table *table, uint32_t row, double least_radius, double step, double limit)
{
    double x = table->x[row], y = table->y[row], c = table->cos[row], s = table->sin[row], radius = least_radius;
    uint32_t at;

    table->found = 0;
    table_refresh_grid(table);
    if (step > 0.0) {
        double other = sqrt(table_nearest_other(table, row, limit));

        if (other >= radius - ROUNDING) {
            radius = most(radius, least(limit, other + step + ROUNDING));
        }
    }
    table_collect(table, row, radius);
    for (at = 0; at < table->near; at++) {
        uint32_t other = table->near_row[at];
        double dx = table->x[other] - x, dy = table->y[other] - y, distance = dx * dx + dy * dy;

        if (!(distance < radius * radius)) {
            continue;
        }
        distance = sqrt(distance);
        if (table->occlusion && hidden(table, row, other, distance)) {
            continue;
        }
        table->found_row[table->found] = other;
        table->found_bearing[table->found] = atan2(dy * c - dx * s, dx * c + dy * s);
        table->found_distance[table->found] = distance;
        table->found++;
    }
}

/* The rays that may meet something whose bearing lies between two, in rad, the second being at most a turn greater. */
static void shine(double from, double to, uint32_t directions, int32_t *first, int32_t *last)
{
    *first = (int32_t)floor(from / TURN * directions);
    *last = (int32_t)ceil(to / TURN * directions);
    if (*last - *first >= (int32_t)directions) {
        *last = *first + (int32_t)directions - 1;
    }
}

static void meet(kernel_table *table, uint32_t ray, double way, uint8_t robot)
{
    if (way < table->range[ray]) {
        table->range[ray] = way;
        table->range_robots = (table->range_robots & ~(1U << ray)) | (uint32_t)robot << ray;
    }
}

static void range_robots(kernel_table *table, uint32_t row, uint32_t directions, const kernel_vector *rays, double farthest)
{
    double x = table->x[row], y = table->y[row], c = table->cos[row], s = table->sin[row], radius = table->profile.radius;
    uint32_t at;

    table_collect(table, row, farthest + radius);
    for (at = 0; at < table->near; at++) {
        double dx = table->x[table->near_row[at]] - x, dy = table->y[table->near_row[at]] - y;
        double distance = sqrt(dx * dx + dy * dy), bearing, half;
        int32_t first, last;

        if (distance > farthest + radius) {
            continue;
        }
        bearing = atan2(dy * c - dx * s, dx * c + dy * s);
        half = distance > radius ? asin(radius / distance) : TURN / 2.0;
        shine(bearing - half, bearing + half, directions, &first, &last);
        for (; first <= last; first++) {
            uint32_t ray = (uint32_t)(first + 2 * (int32_t)directions) % directions;

            meet(table, ray, to_disc(dx, dy, rays[ray].x, rays[ray].y, radius), 1);
        }
    }
}

static void range_walls(kernel_table *table, uint32_t row, uint32_t directions, const kernel_vector *rays)
{
    double x = table->x[row], y = table->y[row], c = table->cos[row], s = table->sin[row];
    uint32_t wall;

    for (wall = 0; wall < table->walls; wall++) {
        const double *end = table->wall + 4 * wall;
        double ax = end[0] - x, ay = end[1] - y, bx = end[2] - x, by = end[3] - y;
        double from = atan2(ay * c - ax * s, ax * c + ay * s), turned = atan2(ax * by - ay * bx, ax * bx + ay * by);
        int32_t first, last;

        shine(turned < 0.0 ? from + turned : from, turned < 0.0 ? from : from + turned, directions, &first, &last);
        for (; first <= last; first++) {
            uint32_t ray = (uint32_t)(first + 2 * (int32_t)directions) % directions;

            meet(table, ray, to_wall(end, x, y, rays[ray].x, rays[ray].y), 0);
        }
    }
}

void table_ranges(kernel_table *table, uint32_t row, uint32_t directions, double farthest)
{
    const table_profile *profile = &table->profile;
    kernel_vector rays[TABLE_DIRECTIONS];
    const double *deviate = table_draw(table, NOISE_RANGE, row, 2 * directions);
    uint32_t ray;

    table->range_robots = 0;
    for (ray = 0; ray < directions; ray++) {
        double bearing = table->angle[row] + ray * TURN / directions;

        rays[ray].x = cos(bearing);
        rays[ray].y = sin(bearing);
        table->range[ray] = INFINITY;
    }
    range_robots(table, row, directions, rays, farthest);
    range_walls(table, row, directions, rays);
    for (ray = 0; ray < directions; ray++) {
        if (table->box_kind != TABLE_NO_BOX) {
            meet(table, ray, to_box(table, table->x[row], table->y[row], rays[ray].x, rays[ray].y), 0);
        }
        if (table->range[ray] > farthest) {
            table->range[ray] = INFINITY;
            table->range_robots &= ~(1U << ray);
        } else {
            double factor = 1.0 + profile->range_share_sd * deviate[2 * ray];

            table->range[ray] = most(0.0, table->range[ray] * factor + profile->range_sd * deviate[2 * ray + 1]);
        }
    }
}

static double bearing_of(const kernel_table *table, uint32_t row, double x, double y, double error)
{
    double dx = x - table->x[row], dy = y - table->y[row], c = table->cos[row], s = table->sin[row];

    return remainder(atan2(dy * c - dx * s, dx * c + dy * s) + error, TURN);
}

void table_box(kernel_table *table, uint32_t row)
{
    const table_profile *profile = &table->profile;
    const double *deviate;
    kernel_vector nearest;
    double gap;

    table->box_bearing = table->box_distance = NAN;
    if (table->box_kind == TABLE_NO_BOX) {
        return;
    }
    deviate = table_draw(table, NOISE_BOX, row, 2);
    gap = table_box_gap(table, table->x[row], table->y[row], &nearest);
    table->box_bearing = bearing_of(table, row, table->box_x, table->box_y, profile->box_bearing_sd * deviate[0]);
    table->box_distance = most(0.0, gap + profile->box_distance_sd * deviate[1]);
}

void table_goal(kernel_table *table, uint32_t row)
{
    table->goal_bearing = NAN;
    if (table->has_goal) {
        const double *deviate = table_draw(table, NOISE_GOAL, row, 1);

        table->goal_bearing = bearing_of(table, row, table->goal_x, table->goal_y, table->profile.goal_bearing_sd * deviate[0]);
    }
}
