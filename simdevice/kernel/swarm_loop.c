#include "swarm_loop.h"

#include <math.h>
#include <string.h>

static const double TURN = 6.283185307179586; /* a full one, in rad */
static const double ANGLES = 65536.0;         /* the firmware's, in a turn */
static const double FARTHEST_UM = 2e9;
enum { WITHOUT_END = 65535, MOST_SAID = sizeof(((host_io *)0)->tx) };

/* Of all angles that the firmware has, the one below: a robot on the border of two sectors is in the upper one. */
static uint16_t angle_below(double angle)
{
    return (uint16_t)(int32_t)floor(angle / TURN * ANGLES);
}

static uint16_t nearest_angle(double angle)
{
    return (uint16_t)(int32_t)nearbyint(angle / TURN * ANGLES);
}

static int32_t micrometres(double place)
{
    double um = nearbyint(place * 1e6);

    return (int32_t)(um < -FARTHEST_UM ? -FARTHEST_UM : um > FARTHEST_UM ? FARTHEST_UM : um);
}

static uint16_t millimetres(double length)
{
    double mm = nearbyint(length * 1e3);

    return (uint16_t)(mm < 0.0 ? 0.0 : mm < WITHOUT_END ? mm : WITHOUT_END);
}

static double metres(uint16_t mm)
{
    return mm == WITHOUT_END ? INFINITY : mm / 1000.0;
}

/* Counters of way have 32 bits: after 2147 m they go on from the other end. */
static int32_t way(double metres_rolled)
{
    return (int32_t)(uint32_t)(int64_t)(metres_rolled * 1e6);
}

static void read_ring(kernel_swarm *swarm, uint32_t row)
{
    kernel_table *table = swarm->table;
    host_io *io = &swarm->robot[row]->io;
    uint32_t at;

    table_ring(table, row, metres(io->least), metres(io->step), metres(io->limit));
    for (at = 0; at < table->found; at++) {
        double um = floor(table->found_distance[at] * 1e6);

        swarm->near_group[at] = table->group[table->found_row[at]];
        swarm->near_bearing[at] = angle_below(table->found_bearing[at]);
        swarm->near_um[at] = (uint32_t)(um < 2.0 * FARTHEST_UM ? um : 2.0 * FARTHEST_UM);
    }
    host_see(swarm->robot[row], table->found, swarm->near_group, swarm->near_bearing, swarm->near_um);
    if (io->ranges > 0) {
        table_ranges(table, row, io->ranges, metres(io->farthest));
        for (at = 0; at < io->ranges; at++) {
            io->range[at] = millimetres(table->range[at]);
        }
        io->range_robots = table->range_robots;
    }
}

/* All that the robot has asked for in the period before. */
static void read_senses(kernel_swarm *swarm, uint32_t row)
{
    kernel_table *table = swarm->table;
    host_io *io = &swarm->robot[row]->io;

    if (io->has_ring) {
        read_ring(swarm, row);
    }
    io->has_box = table->box_kind != TABLE_NO_BOX;
    if (io->has_box) {
        table_box(table, row);
        io->box_bearing = nearest_angle(table->box_bearing);
        io->box_distance = millimetres(table->box_distance);
    }
    io->has_goal = table->has_goal;
    if (io->has_goal) {
        table_goal(table, row);
        io->goal_bearing = nearest_angle(table->goal_bearing);
    }
}

static void read_drivers(kernel_swarm *swarm, uint32_t row)
{
    const kernel_table *table = swarm->table;
    host_io *io = &swarm->robot[row]->io;

    io->battery_mv = (uint16_t)(swarm->voltage[row] * 1e3);
    io->travel_um[0] = way(table->travel[2 * row]);
    io->travel_um[1] = way(table->travel[2 * row + 1]);
    io->bump = table->bump[row];
    io->touch = table->touch[row];
    if (table->fix_age[row] == 0) {
        io->fix_um[0] = micrometres(table->fix_x[row]);
        io->fix_um[1] = micrometres(table->fix_y[row]);
        io->fix_heading = nearest_angle(table->fix_angle[row]);
        io->fix_age = 0;
        io->fix_new = 1;
    }
    io->ready = 1;
    if (io->asked) {
        read_senses(swarm, row);
    }
}

static void keep_words(kernel_swarm *swarm, uint32_t row, uint32_t period, uint32_t length)
{
    uint32_t piece = swarm->pieces++;

    memcpy(swarm->said + swarm->said_used, swarm->robot[row]->io.tx, length);
    swarm->said_at[piece] = swarm->said_used;
    swarm->said_len[piece] = length;
    swarm->said_row[piece] = row;
    swarm->said_period[piece] = period;
    swarm->said_used += length;
}

static void set_wheels(kernel_swarm *swarm, uint32_t row)
{
    kernel_table *table = swarm->table;
    const host_io *io = &swarm->robot[row]->io;
    double gap = io->gap / 1000.0;

    table->command[2 * row] = io->wheel[0] * 1e-3 * swarm->full_speed;
    table->command[2 * row + 1] = io->wheel[1] * 1e-3 * swarm->full_speed;
    table->effort[row] = io->force / 100.0;
    table->gap[row] = gap < table->most_gap ? gap : table->most_gap;
    table->group[row] = host_class(swarm->robot[row]);
}

/* Returns what has happened. */
static uint8_t live(kernel_swarm *swarm, uint32_t row, uint32_t period)
{
    host_robot *robot = swarm->robot[row];
    uint32_t sent;
    uint8_t happened = 0;

    if (!swarm->running[row]) {
        swarm->table->command[2 * row] = 0.0;
        swarm->table->command[2 * row + 1] = 0.0;
        swarm->rx_len[row] = 0;
        return 0;
    }
    read_drivers(swarm, row);
    sent = host_tick(robot, swarm->micros[row], swarm->rx[row], swarm->rx_len[row]);
    swarm->rx_len[row] = 0;
    swarm->micros[row] += swarm->period_us;
    if (sent > 0) {
        keep_words(swarm, row, period, sent);
        happened |= SWARM_SAID;
    }
    if (robot->io.reboot) {
        host_restart(robot);
        swarm->micros[row] = 0;
        swarm->rebooted[row] = 1;
        happened |= SWARM_REBOOTED;
    }
    set_wheels(swarm, row);
    return happened;
}

static uint8_t has_room(const kernel_swarm *swarm)
{
    uint32_t count = swarm->table->count;

    return swarm->said_size - swarm->said_used >= count * MOST_SAID && swarm->most_pieces - swarm->pieces >= count;
}

uint32_t swarm_run(kernel_swarm *swarm, uint32_t periods, uint8_t heed)
{
    kernel_table *table = swarm->table;
    uint32_t done = 0, row;

    swarm->said_used = swarm->pieces = 0;
    swarm->stop = 0;
    while (done < periods && !swarm->stop) {
        uint8_t happened = 0;

        if (table->wanting) {
            swarm->stop = SWARM_NOISE;
            break;
        }
        if (!has_room(swarm)) {
            swarm->stop = SWARM_FULL;
            break;
        }
        table_sense(table);
        for (row = 0; row < table->count; row++) {
            happened |= live(swarm, row, done);
        }
        table_step(table);
        done++;
        swarm->stop = happened & heed;
    }
    return done;
}
