/* The hardware functions of the host build. */
#include "host.h"

#include <string.h>

#include "core/core.h"
#include "junior/senses.h"
#include "micro/modules.h"

enum { DEFAULT_TRACK_UM = 30000, DEFAULT_FULL_SPEED = 400 };

static const struct role *const roles[] = {&junior_role, &micro_role};

static host_robot *host_of(void *board)
{
    return board;
}

const struct role *hal_role(void *board)
{
    uint8_t i;

    for (i = 0; i < sizeof roles / sizeof roles[0]; i++) {
        if (roles[i]->product == host_of(board)->io.role) {
            return roles[i];
        }
    }
    return roles[0];
}

uint64_t hal_micros(void *board)
{
    return host_of(board)->micros;
}

uint16_t hal_used(void *board)
{
    return host_of(board)->used; /* this clock stands while the firmware works */
}

uint64_t hal_uid(void *board)
{
    return host_of(board)->io.uid;
}

uint16_t hal_eye(void *board, uint8_t side)
{
    return host_of(board)->io.eye[side];
}

uint16_t hal_floor(void *board, uint8_t side)
{
    return host_of(board)->io.floor[side];
}

uint8_t hal_arm(void *board, uint8_t side)
{
    return host_of(board)->io.arm[side];
}

uint8_t hal_start(void *board)
{
    return host_of(board)->io.start;
}

uint16_t hal_battery(void *board)
{
    return host_of(board)->io.battery_mv;
}

bool hal_has_encoders(void *board)
{
    return host_of(board)->io.has_encoders != 0;
}

bool hal_has_ground(void *board)
{
    return host_of(board)->io.has_ground != 0;
}

int32_t hal_travel(void *board, uint8_t side)
{
    return host_of(board)->io.travel_um[side];
}

int32_t hal_ground(void *board)
{
    return host_of(board)->io.ground_um;
}

uint32_t hal_track(void *board)
{
    return host_of(board)->io.track_um != 0 ? host_of(board)->io.track_um : DEFAULT_TRACK_UM;
}

uint16_t hal_full_speed(void *board)
{
    return host_of(board)->io.full_speed != 0 ? host_of(board)->io.full_speed : DEFAULT_FULL_SPEED;
}

void hal_force(void *board, uint8_t share)
{
    host_of(board)->io.force = share;
}

uint8_t hal_bump(void *board, uint16_t gap)
{
    host_of(board)->io.gap = gap;
    return host_of(board)->io.bump;
}

bool hal_has_pose(void *board)
{
    return host_of(board)->io.has_pose != 0;
}

bool hal_pose(void *board, struct hal_fix *fix)
{
    host_io *io = &host_of(board)->io;

    fix->x = io->fix_um[0];
    fix->y = io->fix_um[1];
    fix->heading = io->fix_heading;
    fix->age = io->fix_age;
    if (!io->fix_new) {
        return false;
    }
    io->fix_new = 0;
    return true;
}

bool hal_has_ring(void *board)
{
    return host_of(board)->io.has_ring != 0;
}

void hal_ring_start(void *board, const struct hal_ring *ring)
{
    host_io *io = &host_of(board)->io;

    io->least = ring->least;
    io->step = ring->step;
    io->limit = ring->limit;
    io->ranges = ring->ranges;
    io->farthest = ring->farthest;
    io->asked = 1;
}

bool hal_ring_ready(void *board)
{
    host_io *io = &host_of(board)->io;

    io->asked = !io->ready;
    return io->ready != 0;
}

bool hal_neighbour(void *board, uint16_t index, struct hal_neighbour *neighbour)
{
    const host_robot *host = host_of(board);

    if (index >= host->neighbours) {
        return false;
    }
    neighbour->group = host->neighbour_group[index];
    neighbour->bearing = host->neighbour_bearing[index];
    neighbour->distance = host->neighbour_distance[index];
    return true;
}

uint16_t hal_range(void *board, uint8_t index, bool *robot)
{
    *robot = (host_of(board)->io.range_robots >> index & 1U) != 0;
    return host_of(board)->io.range[index];
}

bool hal_box(void *board, uint16_t *bearing, uint16_t *distance)
{
    *bearing = host_of(board)->io.box_bearing;
    *distance = host_of(board)->io.box_distance;
    return host_of(board)->io.has_box != 0;
}

bool hal_goal(void *board, uint16_t *bearing)
{
    *bearing = host_of(board)->io.goal_bearing;
    return host_of(board)->io.has_goal != 0;
}

bool hal_touch(void *board)
{
    return host_of(board)->io.touch != 0;
}

void host_see(host_robot *host, uint32_t count, const uint8_t *group, const uint16_t *bearing, const uint32_t *um)
{
    host->neighbours = count;
    host->neighbour_group = group;
    host->neighbour_bearing = bearing;
    host->neighbour_distance = um;
}

int16_t host_sine(uint16_t angle)
{
    return angles_sine(angle);
}

uint16_t host_angle(int32_t y, int32_t x)
{
    return angles_of(y, x);
}

void hal_set_wheels(void *board, int16_t left, int16_t right)
{
    host_of(board)->io.wheel[0] = left;
    host_of(board)->io.wheel[1] = right;
}

int16_t hal_read(void *board)
{
    host_robot *host = host_of(board);

    if (host->rx_len == 0) {
        return -1;
    }
    host->rx_len--;
    return *host->rx++;
}

uint16_t hal_write_room(void *board)
{
    const host_robot *host = host_of(board);

    if (host->tx_buffer > 0) {
        return (uint16_t)(host->tx_buffer - host->tx_backlog);
    }
    return (uint16_t)(sizeof host->io.tx - host->io.tx_len);
}

void hal_write(void *board, const uint8_t *data, uint8_t length)
{
    host_robot *host = host_of(board);

    memcpy(host->io.tx + host->io.tx_len, data, length);
    host->io.tx_len += length;
    host->tx_backlog += length;
}

/* A frame in rx and tx: identifier (4 bytes, bit 31 a 29-bit one), length, 3 bytes of zero, data (8). */
enum { RECORD = 16, AT_LENGTH = 4, AT_DATA = 8, MOST_DATA = 8 };

bool hal_has_can(void *board)
{
    return host_of(board)->io.can != 0;
}

bool hal_frame_read(void *board, struct hal_frame *frame)
{
    host_robot *host = host_of(board);

    while (host->rx_len >= RECORD) {
        const uint8_t *bytes = host->rx;
        uint32_t identifier = bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;

        host->rx += RECORD;
        host->rx_len -= RECORD;
        if (identifier <= 0x7FF && bytes[AT_LENGTH] <= MOST_DATA) {
            frame->identifier = (uint16_t)identifier;
            frame->length = bytes[AT_LENGTH];
            memcpy(frame->data, bytes + AT_DATA, MOST_DATA);
            return true;
        }
    }
    host->rx_len = 0;
    return false;
}

uint16_t hal_frame_room(void *board)
{
    return (uint16_t)(hal_write_room(board) / RECORD);
}

void hal_frame_write(void *board, const struct hal_frame *frame)
{
    uint8_t bytes[RECORD] = {0};

    bytes[0] = (uint8_t)frame->identifier;
    bytes[1] = (uint8_t)(frame->identifier >> 8);
    bytes[AT_LENGTH] = frame->length;
    memcpy(bytes + AT_DATA, frame->data, frame->length);
    hal_write(board, bytes, RECORD);
}

uint8_t hal_nvm_read(void *board, uint16_t address)
{
    return host_of(board)->io.nvm[address % HAL_NVM_SIZE];
}

bool hal_nvm_ready(void *board)
{
    return host_of(board)->nvm_per_tick == 0 || host_of(board)->nvm_left > 0;
}

void hal_nvm_write(void *board, uint16_t address, uint8_t value)
{
    host_robot *host = host_of(board);

    if (host->nvm_left > 0) {
        host->nvm_left--;
    }
    if (host->writes_left == 0) {
        return;
    }
    if (host->writes_left > 0) {
        host->writes_left--;
    }
    host->writes++;
    host->io.nvm[address % HAL_NVM_SIZE] = value;
}

void hal_reboot(void *board)
{
    host_of(board)->io.reboot = 1;
}

void host_power_on(host_robot *host, uint64_t micros)
{
    host_power_on_cut(host, micros, -1);
}

void host_power_on_cut(host_robot *host, uint64_t micros, int32_t writes)
{
    host->micros = micros;
    host->rx = NULL;
    host->rx_len = 0;
    host->writes_left = writes;
    host->writes = 0;
    host_slow_down(host, 0, 0, 0);
    host_be_busy(host, 0);
    host->tx_backlog = 0;
    host->io.tx_len = 0;
    host->io.reboot = 0;
    host->io.asked = 0;
    memset(&host->as, 0, sizeof host->as);
    robot_power_on(&host->as.robot, host);
}

void host_restart(host_robot *host)
{
    host_io before = host->io;

    memset(host, 0, sizeof *host);
    memcpy(host->io.nvm, before.nvm, sizeof before.nvm);
    host->io.uid = before.uid;
    host->io.can = before.can;
    host->io.role = before.role;
    host->io.has_pose = before.has_pose;
    host->io.has_ring = before.has_ring;
    host->io.full_speed = before.full_speed;
    host->io.track_um = before.track_um;
    host->io.start = before.start;
    host->io.has_encoders = before.has_encoders;
    host->io.has_ground = before.has_ground;
    memcpy(host->io.tx, before.tx, before.tx_len); /* on its way already */
    host_power_on(host, 0);
}

void host_give_key(host_robot *host, const uint8_t *key)
{
    mavlink_setup_signing_t setup;

    memset(&host->as, 0, sizeof host->as);
    host->as.robot.board = host;
    host->writes_left = -1;
    host->nvm_per_tick = 0;
    memset(&setup, 0, sizeof setup);
    memcpy(setup.secret_key, key, sizeof setup.secret_key);
    signing_setup(&host->as.robot, &setup);
    while (host->as.robot.signing.job != SIGNING_IDLE) {
        signing_step(&host->as.robot);
    }
}

uint32_t host_tick(host_robot *host, uint64_t micros, const uint8_t *rx, uint32_t rx_len)
{
    host->micros = micros;
    host->rx = rx;
    host->rx_len = rx_len;
    host->io.tx_len = 0;
    host->nvm_left = host->nvm_per_tick;
    host->tx_backlog -= host->tx_backlog < host->tx_per_tick ? host->tx_backlog : host->tx_per_tick;
    robot_tick(&host->as.robot);
    host->rx = NULL;
    host->rx_len = 0;
    return host->io.tx_len;
}

void host_cut_power(host_robot *host, int32_t writes)
{
    host->writes_left = writes;
}

void host_slow_down(host_robot *host, uint32_t nvm_per_tick, uint32_t tx_buffer, uint32_t tx_per_tick)
{
    host->nvm_per_tick = nvm_per_tick;
    host->tx_buffer = tx_buffer < sizeof host->io.tx ? tx_buffer : (uint32_t)sizeof host->io.tx;
    host->tx_per_tick = tx_per_tick;
    host->tx_backlog = 0;
}

void host_be_busy(host_robot *host, uint16_t micros)
{
    host->used = micros;
}

uint8_t host_state(const host_robot *host)
{
    return host->as.robot.state;
}

uint32_t host_nvm_writes(const host_robot *host)
{
    return host->writes;
}

uint32_t host_can_send(host_robot *host, uint16_t id, const uint8_t *payload, uint8_t length)
{
    const struct role *role = hal_role(host);
    uint8_t crc_extra = 0, i;

    host->io.tx_len = 0;
    for (i = 0; i < role->can_count; i++) {
        if (role->can[i].id == id) {
            crc_extra = role->can[i].crc_extra;
        }
    }
    can_send(&host->as.robot, id, crc_extra, payload, length);
    return host->io.tx_len;
}

int32_t host_can_take(host_robot *host, const uint8_t *rx, uint32_t rx_len, uint8_t *payload)
{
    struct hal_frame frame;
    struct can_message message;
    int32_t id = -1;

    host->rx = rx;
    host->rx_len = rx_len;
    while (hal_frame_read(host, &frame)) {
        if (can_take(&host->as.robot, &frame, &message)) {
            id = message.id;
            memcpy(payload, message.payload.bytes, sizeof message.payload);
        }
    }
    return id;
}
