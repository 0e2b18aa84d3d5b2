/* A million random and damaged bytes into the core, built with sanitizers.
 *
 * Whatever comes, wheels don't turn while the robot is disarmed, and the next good frame is understood. Seeds are
 * fixed: every run is the same. An optional argument is the number of bytes.
 */
#include "fuzz.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint32_t fill(struct fuzz *fuzz, uint8_t *chunk)
{
    uint8_t frame[LARGEST + 32];
    uint32_t used = 0;
    uint8_t length, i;

    while (used + sizeof frame < CHUNK) {
        switch (fuzz_draw(fuzz) % 4) {
        case 0: /* noise, with many start markers */
            length = (uint8_t)(fuzz_draw(fuzz) % 40);
            for (i = 0; i < length; i++) {
                chunk[used++] = (uint8_t)(fuzz_draw(fuzz) % 5 ? fuzz_draw(fuzz) : 0xFD);
            }
            break;
        case 1: /* damaged */
            length = fuzz_random_frame(fuzz, frame);
            for (i = 0; i <= fuzz_draw(fuzz) % 3; i++) {
                frame[fuzz_draw(fuzz) % length] ^= (uint8_t)(1U << fuzz_draw(fuzz) % 8);
            }
            memcpy(chunk + used, frame, length);
            used += length;
            break;
        case 2: /* broken off */
            length = (uint8_t)(fuzz_random_frame(fuzz, frame) / 2);
            memcpy(chunk + used, frame, length);
            used += length;
            break;
        default:
            length = fuzz_random_frame(fuzz, frame);
            memcpy(chunk + used, frame, length);
            used += length;
            break;
        }
    }
    return used;
}

/* Nothing arms the robot here: its wheels must stand still. */
static void run_disarmed(struct fuzz *fuzz, uint32_t bytes)
{
    uint8_t chunk[CHUNK];
    uint32_t done = 0, rounds = 0;

    while (done < bytes) {
        uint32_t used = fill(fuzz, chunk);

        fuzz_tick(fuzz, chunk, used);
        done += used;
        fuzz_check(fuzz->host.as.robot.state == ROBOT_STATE_DISARMED || fuzz->host.as.robot.state == ROBOT_STATE_STOPPED,
              "armed by damaged bytes");
        fuzz_check(fuzz->host.io.wheel[0] == 0 && fuzz->host.io.wheel[1] == 0, "wheels turn while disarmed");
        if (++rounds % 50 == 0) {
            fuzz_check_understands(fuzz);
        }
    }
}

enum { HOST_NUMBER = 7, SESSION = 0x0101 };

static void say(struct fuzz *fuzz, uint8_t row, const void *message, uint8_t length)
{
    uint8_t payload[LARGEST] = {0}, frame[FUZZ_FRAME];

    memcpy(payload, message, length);
    fuzz_tick(fuzz, frame, fuzz_build(fuzz, frame, &fuzz_rows[row], payload));
}

static void perform(struct fuzz *fuzz, uint16_t sequence)
{
    mavlink_junior_maneuver_t maneuver = {SESSION, sequence, 20, 15, 1, 1, 8, {5, 6, 7, 8, 9, 10, 11, 12}};

    say(fuzz, ROW_JUNIOR_MANEUVER, &maneuver, MAVLINK_MSG_ID_JUNIOR_MANEUVER_LEN);
}

static void begin_contest(struct fuzz *fuzz, uint16_t sequence)
{
    mavlink_junior_contest_t contest = {SESSION, sequence, 10, 1, 1, 1};

    say(fuzz, ROW_JUNIOR_CONTEST, &contest, MAVLINK_MSG_ID_JUNIOR_CONTEST_LEN);
}

static void move(struct fuzz *fuzz, uint16_t sequence)
{
    mavlink_swarm_move_t move;

    memset(&move, 0, sizeof move);
    move.session = SESSION;
    move.sequence = sequence;
    move.heading = (int16_t)fuzz_draw(fuzz);
    move.distance = (uint16_t)(fuzz_draw(fuzz) % 2 ? fuzz_draw(fuzz) % 100 : fuzz_draw(fuzz));
    move.face = (int16_t)fuzz_draw(fuzz);
    move.speed = (uint16_t)(fuzz_draw(fuzz) % 2 ? 0 : fuzz_draw(fuzz));
    move.options = (uint8_t)(fuzz_draw(fuzz) % 64);
    move.target_system = 1;
    move.target_component = 1;
    say(fuzz, ROW_SWARM_MOVE, &move, MAVLINK_MSG_ID_SWARM_MOVE_LEN);
}

/* Armed and in session all the time, so that motion, memory and contest run on whatever comes. */
static void run_armed(struct fuzz *fuzz, uint32_t bytes)
{
    uint8_t chunk[CHUNK], payload[LARGEST], frame[LARGEST + 32];
    mavlink_command_long_t arm = {1.0f, 0, HOST_NUMBER, 0, 0, 0, 0, MAV_CMD_COMPONENT_ARM_DISARM, 1, 1, 0};
    mavlink_robot_session_t session = {SESSION, 0, HOST_NUMBER, 1, 1, PROTOCOL_MAJOR, PROTOCOL_MINOR};
    uint32_t done = 0;
    uint16_t number = 0;

    while (done < bytes) {
        uint32_t used;

        if (fuzz->host.as.robot.state == ROBOT_STATE_STOPPED || !fuzz->host.as.robot.session.open
            || fuzz->host.as.robot.session.id != session.session) {
            memset(payload, 0, sizeof payload);
            memcpy(payload, &session, MAVLINK_MSG_ID_ROBOT_SESSION_LEN);
            fuzz_tick(fuzz, frame, fuzz_build(fuzz, frame, &fuzz_rows[ROW_ROBOT_SESSION], payload));
            arm.param1 = 0.0f;
            memcpy(payload, &arm, MAVLINK_MSG_ID_COMMAND_LONG_LEN);
            fuzz_tick(fuzz, frame, fuzz_build(fuzz, frame, &fuzz_rows[ROW_COMMAND_LONG], payload));
            number = fuzz->host.as.robot.session.last;
        }
        arm.param1 = 1.0f;
        memcpy(payload, &arm, MAVLINK_MSG_ID_COMMAND_LONG_LEN);
        fuzz_tick(fuzz, frame, fuzz_build(fuzz, frame, &fuzz_rows[ROW_COMMAND_LONG], payload));
        if (fuzz->host.io.role == FUZZ_MICRO) {
            move(fuzz, ++number);
        } else {
            perform(fuzz, ++number);
            if (fuzz_draw(fuzz) % 16 == 0) {
                begin_contest(fuzz, ++number);
            }
        }
        used = fill(fuzz, chunk);
        fuzz_tick(fuzz, chunk, used);
        done += used;
        fuzz_check(fuzz->host.io.wheel[0] >= -1000 && fuzz->host.io.wheel[0] <= 1000 && fuzz->host.io.wheel[1] >= -1000
                  && fuzz->host.io.wheel[1] <= 1000,
              "more effort than there is");
    }
    fuzz_add_up(fuzz);
    fuzz_check(fuzz->total.maneuvers > 1000, "hardly a maneuver or move was performed: this fuzzes less than it should");
}

enum { RECORD = 16, FRAMES = 24, HEAD = 3, PART = 7 };

/* A frame as the host build takes it; returns its length. */
static uint32_t record(uint8_t *bytes, uint16_t identifier, uint8_t length, const uint8_t *data)
{
    memset(bytes, 0, RECORD);
    bytes[0] = (uint8_t)identifier;
    bytes[1] = (uint8_t)(identifier >> 8);
    bytes[4] = length;
    memcpy(bytes + 8, data, length);
    return RECORD;
}

/* A transfer with values at random, parts of which may be lost, doubled or damaged. */
static uint32_t transfer(struct fuzz *fuzz, uint8_t *chunk, const struct row *row, const uint8_t *payload, uint8_t damage)
{
    uint8_t data[LARGEST + 8], frame[8];
    uint8_t cut = row->system_at == 255 ? 0 : row->component_at == 255 ? 1 : 2;
    uint8_t length = 0, at = HEAD, i, size;
    uint32_t used = 0;
    uint16_t identifier = (uint16_t)(CAN_FUNCTION_TRANSFER_DOWN << 7 | (fuzz_draw(fuzz) % 8 ? 1 : 0));
    uint16_t crc = 0xFFFF;

    for (i = 0; i < row->length; i++) {
        if (cut == 0 || i < row->system_at || i >= row->system_at + cut) {
            data[at++] = payload[i];
            length++;
        }
    }
    data[0] = (uint8_t)row->id;
    data[1] = (uint8_t)(row->id >> 8);
    data[2] = length;
    for (i = 0; i < at; i++) {
        crc = wire_crc(crc, data[i]);
    }
    crc = wire_crc(crc, row->crc_extra);
    data[at++] = (uint8_t)crc;
    data[at++] = (uint8_t)(crc >> 8);
    for (i = 0; i * PART < at; i++) {
        size = (uint8_t)(at - i * PART < PART ? at - i * PART : PART);
        frame[0] = (uint8_t)(fuzz->sequence << 5 | i);
        memcpy(frame + 1, data + i * PART, size);
        if (damage && fuzz_draw(fuzz) % 8 == 0) {
            frame[fuzz_draw(fuzz) % (size + 1U)] ^= (uint8_t)(1U << fuzz_draw(fuzz) % 8);
        }
        if (damage && fuzz_draw(fuzz) % 16 == 0) {
            continue;
        }
        used += record(chunk + used, identifier, (uint8_t)(damage && fuzz_draw(fuzz) % 16 == 0 ? fuzz_draw(fuzz) % 9 : size + 1U), frame);
    }
    fuzz->sequence = (uint8_t)((fuzz->sequence + 1) % 8);
    return used;
}

/* CAN frames of every kind, whole and damaged, while disarmed: the wheels stand still. */
static void run_can(struct fuzz *fuzz, uint32_t rounds)
{
    uint8_t chunk[RECORD * FRAMES], payload[LARGEST];
    uint32_t round, used, good;
    uint8_t i;

    fuzz->host.io.can = 1;
    host_power_on(&fuzz->host, fuzz->micros);
    for (round = 0; round < rounds; round++) {
        const struct row *row = &fuzz_rows[fuzz_draw(fuzz) % FUZZ_UNSIGNED];
        uint16_t command = 511;

        for (i = 0; i < LARGEST; i++) {
            payload[i] = (uint8_t)(fuzz_draw(fuzz) % 3 ? fuzz_draw(fuzz) % 9 : fuzz_draw(fuzz));
        }
        if (row->id == MAVLINK_MSG_ID_COMMAND_LONG) { /* nothing that arms */
            memcpy(payload + 28, &command, sizeof command);
        }
        if (row->id == MAVLINK_MSG_ID_PARAM_SET) {
            payload[0] = 0; /* no name of a parameter can begin like this: SYS_ID stays */
            memset(payload + 6, 0, 16);
        }
        used = transfer(fuzz, chunk, row, payload, fuzz_draw(fuzz) % 2);
        for (i = 0; i < 8; i++) {
            payload[i] = (uint8_t)fuzz_draw(fuzz);
        }
        used += record(chunk + used, (uint16_t)(fuzz_draw(fuzz) % 2 ? fuzz_draw(fuzz) % 0x800 : fuzz_draw(fuzz) % 2 << 8 | 1),
                       (uint8_t)(fuzz_draw(fuzz) % 9), payload);
        fuzz_tick(fuzz, chunk, used);
        fuzz_check(fuzz->host.io.wheel[0] == 0 && fuzz->host.io.wheel[1] == 0, "wheels turn while disarmed, over CAN");
        if (round % 50 == 0) {
            memset(payload, 0, sizeof payload);
            good = fuzz->host.as.robot.counters.good;
            used = transfer(fuzz, chunk, &fuzz_rows[ROW_PING], payload, 0);
            fuzz_tick(fuzz, chunk, used);
            fuzz_check(fuzz->host.as.robot.counters.good == good + 1 || fuzz->host.io.reboot, "the next good transfer was not understood");
        }
    }
    fuzz_check(fuzz->host.as.robot.counters.good > rounds / 4, "hardly a transfer was understood");
    printf("%lu rounds over CAN: good %lu, bad checksum %lu, unknown %lu, lost %lu\n", (unsigned long)rounds,
           (unsigned long)fuzz->host.as.robot.counters.good, (unsigned long)fuzz->host.as.robot.counters.bad_checksum,
           (unsigned long)fuzz->host.as.robot.counters.unknown, (unsigned long)fuzz->host.as.robot.counters.lost);
}

static void run_role(struct fuzz *fuzz, uint8_t role, uint32_t bytes)
{
    host_io *io = &fuzz->host.io;

    memset(io, 0, sizeof *io);
    memset(io->nvm, 0xFF, sizeof io->nvm);
    memset(&fuzz->total, 0, sizeof fuzz->total);
    io->role = role;
    io->has_ground = io->has_encoders = io->has_ring = io->has_pose = 1;
    host_power_on(&fuzz->host, fuzz->micros);
    run_disarmed(fuzz, bytes);
    fuzz_check_understands(fuzz);
    run_armed(fuzz, bytes);
    printf("role %u: %lu bytes disarmed, as many armed: good %lu, bad checksum %lu, unknown %lu, maneuvers %lu, boots %u\n", role,
           (unsigned long)bytes, (unsigned long)fuzz->total.good, (unsigned long)fuzz->total.bad_checksum,
           (unsigned long)fuzz->total.unknown, (unsigned long)fuzz->total.maneuvers, fuzz->total.boots);
    run_can(fuzz, bytes / 20);
}

int main(int argc, char **argv)
{
    uint32_t bytes = argc > 1 ? (uint32_t)strtoul(argv[1], NULL, 10) : 1000000UL;
    static struct fuzz fuzz;

    fuzz.random = 2463534242UL;
    run_role(&fuzz, FUZZ_MICRO, bytes / 2);
    run_role(&fuzz, FUZZ_JUNIOR, bytes);
    fuzz_run_signed(&fuzz, bytes / 100);
    return 0;
}
