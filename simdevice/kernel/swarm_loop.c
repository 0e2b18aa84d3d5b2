#include "swarm_loop.h"

#include <math.h>
#include <string.h>

enum { MILLIMETRES_NONE = 65535, SYSTEMS = 256, SIDES = 2, CONTACTS = 16 };

static const double PER_RAD = 10430.378350470453; /* 65536 are a turn */

/* --- what its drivers read ----------------------------------------------------------------------------------------- */

static uint16_t angle_of(double angle)
{
    return (uint16_t)(int32_t)lrint(angle * PER_RAD);
}

/* Counters of way have 32 bits: after 2147 m they go on from the other end. */
static int32_t micrometres(double way)
{
    return (int32_t)(uint32_t)(int64_t)(way * 1e6);
}

static uint16_t millimetres(double way)
{
    return way < MILLIMETRES_NONE * 1e-3 ? (uint16_t)lrint(way * 1e3) : MILLIMETRES_NONE;
}

static double metres(uint16_t way)
{
    return way == MILLIMETRES_NONE ? INFINITY : way * 1e-3;
}

static void see(swarm_loop *loop, uint32_t row)
{
    kernel_table *table = loop->table;
    host_io *io = &loop->robot[row].io;
    uint32_t i;

    if (!io->has_ring) {
        host_see(&loop->robot[row], 0, loop->seen_group, loop->seen_bearing, loop->seen_um);
        return;
    }
    table_ring(table, row, metres(io->least), io->step * 1e-3, metres(io->limit));
    for (i = 0; i < table->found; i++) {
        loop->seen_group[i] = table->group[table->found_row[i]];
        loop->seen_bearing[i] = angle_of(table->found_bearing[i]);
        loop->seen_um[i] = (uint32_t)llrint(table->found_distance[i] * 1e6);
    }
    host_see(&loop->robot[row], table->found, loop->seen_group, loop->seen_bearing, loop->seen_um);
}

static void range(swarm_loop *loop, uint32_t row)
{
    kernel_table *table = loop->table;
    host_io *io = &loop->robot[row].io;
    uint32_t i;

    table_ranges(table, row, io->ranges, metres(io->farthest));
    for (i = 0; i < io->ranges; i++) {
        io->range[i] = millimetres(table->range[i]);
    }
    io->range_robots = table->range_robots;
}

/* All that it has asked for. */
static void look(swarm_loop *loop, uint32_t row)
{
    kernel_table *table = loop->table;
    host_io *io = &loop->robot[row].io;

    see(loop, row);
    if (io->ranges > 0) {
        range(loop, row);
    }
    io->has_box = table->box_kind != TABLE_NO_BOX;
    if (io->has_box) {
        table_box(table, row);
        io->box_bearing = angle_of(table->box_bearing);
        io->box_distance = table->box_distance > 0.0 ? millimetres(table->box_distance) : 0;
    }
    io->has_goal = table->has_goal;
    if (io->has_goal) {
        table_goal(table, row);
        io->goal_bearing = angle_of(table->goal_bearing);
    }
    io->ready = 1;
}

static int32_t encoder(const kernel_table *table, uint32_t wheel)
{
    return (int32_t)(table->counted[wheel] + (uint32_t)micrometres(table->travel[wheel]));
}

static void read_drivers(swarm_loop *loop, uint32_t row)
{
    kernel_table *table = loop->table;
    host_io *io = &loop->robot[row].io;

    io->battery_mv = loop->battery[row];
    io->travel_um[0] = encoder(table, 2 * row);
    io->travel_um[1] = encoder(table, 2 * row + 1);
    io->bump = table->bump[row];
    io->touch = table->touch[row];
    if (table->fix_age[row] == 0) {
        io->fix_um[0] = micrometres(table->fix_x[row]);
        io->fix_um[1] = micrometres(table->fix_y[row]);
        io->fix_heading = angle_of(table->fix_angle[row]);
        io->fix_age = 0;
        io->fix_new = 1;
    }
    if (io->asked) {
        look(loop, row);
    }
}

/* --- what its firmware says ----------------------------------------------------------------------------------------- */

static void stand(swarm_loop *loop, uint32_t row)
{
    int side;

    for (side = 0; side < SIDES; side++) {
        loop->table->command[2 * row + (uint32_t)side] = 0.0;
    }
}

static void obey(swarm_loop *loop, uint32_t row)
{
    kernel_table *table = loop->table;
    const host_robot *robot = &loop->robot[row];
    const int16_t *parameter = robot->as.robot.params.integer;
    double gap = (uint16_t)parameter[MICRO_PARAM_CONTACT_GAP] * 1e-3; /* hal_bump tells it only when it is asked */
    int side;

    for (side = 0; side < SIDES; side++) {
        table->command[2 * row + (uint32_t)side] = robot->io.wheel[side] * 1e-3 * loop->full_speed;
    }
    table->effort[row] = robot->io.force * 0.01;
    table->gap[row] = gap < table->most_gap ? gap : table->most_gap;
    table->group[row] = parameter[MICRO_PARAM_CLASS] != 0;
    loop->system[row] = robot->as.robot.system;
}

static void boot(swarm_loop *loop, uint32_t row)
{
    loop->micros[row] = 0;
    loop->table->travel[2 * row] = loop->table->travel[2 * row + 1] = 0.0;
    loop->table->counted[2 * row] = loop->table->counted[2 * row + 1] = 0;
    host_restart(&loop->robot[row]);
    loop->system[row] = loop->robot[row].as.robot.system;
}

static uint8_t tick(swarm_loop *loop, uint32_t row, uint32_t *said)
{
    host_robot *robot = &loop->robot[row];
    uint32_t sent;
    uint8_t why = 0;

    read_drivers(loop, row);
    sent = host_tick(robot, loop->micros[row], loop->arrived + loop->rx_at[row], loop->rx_length[row]);
    robot->io.ready = 0;
    loop->micros[row] += loop->period_us;
    obey(loop, row);
    if (sent > 0 && loop->plugged[row]) {
        memcpy(loop->said + *said, robot->io.tx, sent);
        *said += sent;
        why = SWARM_SAID;
    }
    if (robot->io.reboot) {
        boot(loop, row);
        stand(loop, row);
        why |= SWARM_REBOOTED;
    }
    return why;
}

/* --- control periods ------------------------------------------------------------------------------------------------ */

/* Returns 1 where others touch the box now. */
static uint8_t feel(swarm_loop *loop)
{
    const kernel_table *table = loop->table;
    uint16_t touching = 0;
    uint32_t row;

    if (table->box_kind != TABLE_NO_BOX) {
        for (row = 0; row < table->count && row < CONTACTS; row++) {
            touching |= (uint16_t)(table->touch[row] << row);
        }
    }
    if (touching == loop->touching) {
        return 0;
    }
    loop->touching = touching;
    return 1;
}

static uint8_t live(swarm_loop *loop, uint32_t *said)
{
    uint32_t network, row;
    uint8_t why;

    table_sense(loop->table);
    why = feel(loop) ? SWARM_TOUCHED : 0;
    for (network = 0; network < loop->networks; network++) {
        for (row = loop->first[network]; row < loop->first[network + 1]; row++) {
            if (loop->running[row]) {
                why |= tick(loop, row, said);
            }
        }
        loop->end[network] = *said;
    }
    table_step(loop->table);
    loop->ticks++;
    return why;
}

uint64_t swarm_run(swarm_loop *loop, uint32_t periods)
{
    uint32_t done = 0, said = 0, rows = loop->table->count;
    uint8_t why = 0;

    while (done < periods && !why) {
        if (loop->table->wanting) {
            why = SWARM_NOISE;
            break;
        }
        why = live(loop, &said);
        if (loop->arrived_length > 0) {
            memset(loop->rx_length, 0, rows * sizeof *loop->rx_length);
            loop->arrived_length = 0;
        }
        done++;
    }
    return (uint64_t)why << 56 | (uint64_t)done << 32 | said;
}

/* --- power ---------------------------------------------------------------------------------------------------------- */

void swarm_power_on(swarm_loop *loop, uint32_t row)
{
    loop->running[row] = 1;
    boot(loop, row);
}

void swarm_power_off(swarm_loop *loop, uint32_t row)
{
    loop->running[row] = 0;
    stand(loop, row);
}

/* --- what arrives --------------------------------------------------------------------------------------------------- */

static uint8_t hears(const swarm_loop *loop, uint32_t row)
{
    return loop->running[row] && loop->plugged[row];
}

/* By id, the first of the robots that have it, and 1; see next_of. */
static void list_ids(swarm_loop *loop, uint32_t network, uint32_t *first_of)
{
    uint32_t row;

    memset(first_of, 0, SYSTEMS * sizeof *first_of);
    for (row = loop->first[network + 1]; row-- > loop->first[network];) {
        if (hears(loop, row)) {
            loop->next_of[row] = first_of[loop->system[row]];
            first_of[loop->system[row]] = row + 1;
        }
    }
}

uint32_t swarm_wanted(swarm_loop *loop, const swarm_route *route, uint32_t network)
{
    uint32_t first_of[SYSTEMS], for_all = 0, frame, row, next, total = loop->arrived_length;

    list_ids(loop, network, first_of);
    for (frame = 0; frame < route->frames; frame++) {
        if (route->frame_to[frame] == ROUTE_ALL) {
            for_all += route->frame_length[frame];
            continue;
        }
        for (next = first_of[route->frame_to[frame]]; next > 0; next = loop->next_of[next - 1]) {
            loop->rx_length[next - 1] += route->frame_length[frame];
        }
    }
    for (row = loop->first[network]; row < loop->first[network + 1]; row++) {
        if (hears(loop, row)) {
            loop->rx_at[row] = total;
            total += loop->rx_length[row] + for_all;
            loop->rx_length[row] = 0;
        }
    }
    return total;
}

/* Returns where the bytes are now. */
static uint8_t *hand(swarm_loop *loop, uint32_t row, const uint8_t *data, uint32_t length)
{
    uint8_t *at = loop->arrived + loop->rx_at[row] + loop->rx_length[row];

    memcpy(at, data, length);
    loop->rx_length[row] += length;
    loop->arrived_length += length;
    return at;
}

/* lost: so many of the sender's frames before this one never came. */
static void hand_frame(swarm_loop *loop, const swarm_route *route, uint32_t row, const uint8_t *data, uint32_t length,
                       uint32_t sender, uint8_t lost)
{
    uint8_t *frame = hand(loop, row, data, length);
    uint8_t *number = &loop->number[ROUTE_SENDERS * row + sender];

    if (!route->can) {
        swarm_renumber(route, frame, (uint8_t)(*number + lost));
        *number = (uint8_t)(*number + lost + 1);
    }
}

void swarm_deliver(swarm_loop *loop, const swarm_route *route, uint32_t network, const uint8_t *data)
{
    swarm_senders *senders = &loop->senders[network];
    uint32_t first_of[SYSTEMS], frame, row, next, sender = 0;

    list_ids(loop, network, first_of);
    for (frame = 0; frame < route->frames; frame++) {
        const uint8_t *bytes = data + route->frame_at[frame];
        uint32_t length = route->frame_length[frame];

        if (!route->can) {
            sender = swarm_heard(senders, bytes);
        }
        if (route->frame_to[frame] != ROUTE_ALL) {
            for (next = first_of[route->frame_to[frame]]; next > 0; next = loop->next_of[next - 1]) {
                hand_frame(loop, route, next - 1, bytes, length, sender, senders->lost[sender]);
                senders->lost[sender] = 0;
            }
            continue;
        }
        for (row = loop->first[network]; row < loop->first[network + 1]; row++) {
            if (hears(loop, row)) {
                hand_frame(loop, route, row, bytes, length, sender, 0);
            }
        }
    }
}

void swarm_pass(swarm_loop *loop, uint32_t network, const uint8_t *data, uint32_t length)
{
    uint32_t row = loop->first[network];

    if (hears(loop, row)) {
        loop->rx_at[row] = loop->arrived_length;
        hand(loop, row, data, length);
    }
}
