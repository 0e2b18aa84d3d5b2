/* What touches the robots' bodies. */
#include <math.h>
#include <string.h>

#include "order.h"
#include "table.h"

/* The bit of the sector of 45 degrees that a point lies in, by its place in the robot's frame. */
static uint8_t bumper(double x, double y)
{
    uint32_t sector;

    if (y > 0.0 || (y == 0.0 && x >= 0.0)) {
        sector = x > y || (x == 0.0 && y == 0.0) ? 0 : x > 0.0 ? 1 : -x < y ? 2 : 3;
    } else {
        sector = -x > -y ? 4 : x < 0.0 ? 5 : x < -y ? 6 : 7;
    }
    return (uint8_t)(0x80 >> sector);
}

static void close_bumper(kernel_table *table, uint32_t row, double dx, double dy)
{
    double c = table->cos[row], s = table->sin[row];

    table->bump[row] |= bumper(dx * c + dy * s, dy * c - dx * s);
}

static void touch_robots(kernel_table *table)
{
    double width = 2.0 * table->profile.radius, widest = width + table->most_gap;
    uint32_t at;

    for (at = 0; at < table->pairs; at++) {
        uint32_t one = table->pair[2 * at], other = table->pair[2 * at + 1];
        double dx = table->x[other] - table->x[one], dy = table->y[other] - table->y[one];
        double square = dx * dx + dy * dy, reach;

        if (!(square < widest * widest)) {
            continue;
        }
        reach = width + table->gap[one];
        if (square < reach * reach) {
            close_bumper(table, one, dx, dy);
        }
        reach = width + table->gap[other];
        if (square < reach * reach) {
            close_bumper(table, other, -dx, -dy);
        }
    }
}

double table_wall_gap(const kernel_table *table, uint32_t wall, double x, double y, kernel_vector *nearest)
{
    const double *end = table->wall + 4 * wall;
    double along_x = end[2] - end[0], along_y = end[3] - end[1], square = along_x * along_x + along_y * along_y;
    double share = square > 0.0 ? ((x - end[0]) * along_x + (y - end[1]) * along_y) / square : 0.0;

    share = most(0.0, least(1.0, share));
    nearest->x = end[0] + share * along_x;
    nearest->y = end[1] + share * along_y;
    return sqrt((nearest->x - x) * (nearest->x - x) + (nearest->y - y) * (nearest->y - y));
}

static void touch_walls(kernel_table *table, uint32_t row)
{
    double x = table->x[row], y = table->y[row], reach = table->profile.radius + table->gap[row];
    double column = floor((x - table->wall_x) / table->wall_cell), line = floor((y - table->wall_y) / table->wall_cell);
    uint32_t cell, at;

    if (!(column >= 0.0 && line >= 0.0 && column < table->wall_columns && line < table->wall_rows)) {
        return;
    }
    cell = (uint32_t)line * table->wall_columns + (uint32_t)column;
    for (at = table->wall_start[cell]; at < table->wall_start[cell + 1]; at++) {
        kernel_vector nearest;

        if (table_wall_gap(table, table->wall_item[at], x, y, &nearest) < reach) {
            close_bumper(table, row, nearest.x - x, nearest.y - y);
        }
    }
}

double table_box_gap(const kernel_table *table, double x, double y, kernel_vector *nearest)
{
    double dx = x - table->box_x, dy = y - table->box_y, half = table->box_half, c = table->box_cos, s = table->box_sin;
    double ahead, left, over, gap;

    if (table->box_kind == TABLE_CYLINDER) {
        double distance = sqrt(dx * dx + dy * dy), share = distance > 0.0 ? half / distance : 0.0;

        nearest->x = table->box_x + dx * share;
        nearest->y = table->box_y + dy * share;
        return distance - half;
    }
    ahead = dx * c + dy * s; /* in the box's frame */
    left = dy * c - dx * s;
    dx = most(-half, least(half, ahead));
    dy = most(-half, least(half, left));
    if (dx == ahead && dy == left) { /* within it: the nearest face */
        over = fabs(ahead) - fabs(left);
        gap = most(fabs(ahead), fabs(left)) - half;
        dx = over < 0.0 ? ahead : copysign(half, ahead);
        dy = over < 0.0 ? copysign(half, left) : left;
    } else {
        gap = sqrt((ahead - dx) * (ahead - dx) + (left - dy) * (left - dy));
    }
    nearest->x = table->box_x + dx * c - dy * s;
    nearest->y = table->box_y + dx * s + dy * c;
    return gap;
}

static void touch_box(kernel_table *table)
{
    double reach = table->profile.radius + table->most_gap + 1.5 * table->box_half;
    uint32_t row;

    for (row = 0; row < table->count; row++) {
        double x = table->x[row], y = table->y[row], dx = x - table->box_x, dy = y - table->box_y;
        kernel_vector nearest;

        table->touch[row] = 0;
        if (dx * dx + dy * dy < reach * reach &&
            table_box_gap(table, x, y, &nearest) < table->profile.radius + table->gap[row]) {
            table->touch[row] = 1;
            close_bumper(table, row, nearest.x - x, nearest.y - y);
        }
    }
}

void table_contacts(kernel_table *table)
{
    uint32_t row;

    memset(table->bump, 0, table->count);
    table_refresh_grid(table);
    touch_robots(table);
    if (table->walls > 0) {
        for (row = 0; row < table->count; row++) {
            touch_walls(table, row);
        }
    }
    if (table->box_kind != TABLE_NO_BOX) {
        touch_box(table);
    }
}
