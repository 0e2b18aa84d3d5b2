/* A million random and damaged bytes into the core, built with sanitizers.
 *
 * Whatever comes, wheels don't turn while the robot is disarmed, and the next good frame is understood. Seeds are
 * fixed: every run is the same. An optional argument is the number of bytes.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "hal.h"
#include "host.h"

enum { TICK_US = 5000, HEADER = 10, LARGEST = 64, CHUNK = 200 };

struct fuzz {
    host_robot host;
    uint64_t micros;
    uint32_t random;
    uint8_t sequence;
    struct counters total; /* of all boots */
};

static uint32_t draw(struct fuzz *fuzz) /* xorshift32 (Marsaglia 2003) */
{
    fuzz->random ^= fuzz->random << 13;
    fuzz->random ^= fuzz->random >> 17;
    fuzz->random ^= fuzz->random << 5;
    return fuzz->random;
}

static void check(int good, const char *what)
{
    if (!good) {
        fprintf(stderr, "fuzz: %s\n", what);
        exit(1);
    }
}

struct row {
    uint16_t id;
    uint8_t length, crc_extra, system_at, component_at;
};

#define ROW(name, id, base, length, crc_extra, system_at, component_at) {id, length, crc_extra, system_at, component_at},
static const struct row rows[] = {INBOUND_TABLE(ROW)};
#undef ROW
#define ROW(name, id, base, length, crc_extra, system_at, component_at) ROW_##name,
enum { INBOUND_TABLE(ROW) }; /* where a message stands in it */
#undef ROW

static uint8_t build(struct fuzz *fuzz, uint8_t *frame, const struct row *row, const uint8_t *payload)
{
    uint16_t crc = 0xFFFF;
    uint8_t i;

    frame[0] = 0xFD;
    frame[1] = row->length;
    frame[2] = 0;
    frame[3] = 0;
    frame[4] = fuzz->sequence++;
    frame[5] = 255;
    frame[6] = 190;
    frame[7] = (uint8_t)row->id;
    frame[8] = (uint8_t)(row->id >> 8);
    frame[9] = 0;
    memcpy(frame + HEADER, payload, row->length);
    for (i = 1; i < HEADER + row->length; i++) {
        crc = wire_crc(crc, frame[i]);
    }
    crc = wire_crc(crc, row->crc_extra);
    frame[HEADER + row->length] = (uint8_t)crc;
    frame[HEADER + row->length + 1] = (uint8_t)(crc >> 8);
    return (uint8_t)(HEADER + row->length + 2);
}

/* A well-formed frame with values at random; the target is mostly right. What would arm is left out. */
static uint8_t random_frame(struct fuzz *fuzz, uint8_t *frame)
{
    const struct row *row = &rows[draw(fuzz) % INBOUND_COUNT];
    uint8_t payload[LARGEST] = {0};
    uint8_t i;

    for (i = 0; i < row->length; i++) {
        payload[i] = (uint8_t)(draw(fuzz) % 3 == 0 ? draw(fuzz) : draw(fuzz) % 9);
    }
    if (row->system_at != 255) {
        payload[row->system_at] = draw(fuzz) % 8 ? 1 : (uint8_t)draw(fuzz);
    }
    if (row->component_at != 255) {
        payload[row->component_at] = draw(fuzz) % 8 ? 1 : (uint8_t)draw(fuzz);
    }
    if (row->id == MAVLINK_MSG_ID_COMMAND_LONG) {
        static const uint16_t commands[] = {185, 246, 511, 512, 99};
        uint16_t command = commands[draw(fuzz) % 5];
        float number = (float)(draw(fuzz) % 3);

        memcpy(payload + 28, &command, sizeof command);
        if (draw(fuzz) % 2) {
            memcpy(payload, &number, sizeof number);
        }
    }
    return build(fuzz, frame, row, payload);
}

static uint32_t fill(struct fuzz *fuzz, uint8_t *chunk)
{
    uint8_t frame[LARGEST + 32];
    uint32_t used = 0;
    uint8_t length, i;

    while (used + sizeof frame < CHUNK) {
        switch (draw(fuzz) % 4) {
        case 0: /* noise, with many start markers */
            length = (uint8_t)(draw(fuzz) % 40);
            for (i = 0; i < length; i++) {
                chunk[used++] = (uint8_t)(draw(fuzz) % 5 ? draw(fuzz) : 0xFD);
            }
            break;
        case 1: /* damaged */
            length = random_frame(fuzz, frame);
            for (i = 0; i <= draw(fuzz) % 3; i++) {
                frame[draw(fuzz) % length] ^= (uint8_t)(1U << draw(fuzz) % 8);
            }
            memcpy(chunk + used, frame, length);
            used += length;
            break;
        case 2: /* broken off */
            length = (uint8_t)(random_frame(fuzz, frame) / 2);
            memcpy(chunk + used, frame, length);
            used += length;
            break;
        default:
            length = random_frame(fuzz, frame);
            memcpy(chunk + used, frame, length);
            used += length;
            break;
        }
    }
    return used;
}

static void add_up(struct fuzz *fuzz)
{
    const struct counters *counters = &fuzz->host.robot.counters;

    fuzz->total.good += counters->good;
    fuzz->total.bad_checksum += counters->bad_checksum;
    fuzz->total.unknown += counters->unknown;
    fuzz->total.maneuvers += counters->maneuvers;
    fuzz->total.boots = counters->boots;
}

static void tick(struct fuzz *fuzz, const uint8_t *bytes, uint32_t length)
{
    host_io *io = &fuzz->host.io;

    fuzz->micros += TICK_US;
    io->eye[0] = (uint16_t)(draw(fuzz) % 1024);
    io->eye[1] = (uint16_t)(draw(fuzz) % 1024);
    io->floor[0] = (uint16_t)(draw(fuzz) % 1024);
    io->floor[1] = (uint16_t)(draw(fuzz) % 1024);
    io->arm[0] = (uint8_t)(draw(fuzz) % 2);
    io->arm[1] = (uint8_t)(draw(fuzz) % 2);
    io->battery_mv = (uint16_t)draw(fuzz);
    io->travel_um[0] = (int32_t)draw(fuzz);
    io->travel_um[1] = (int32_t)draw(fuzz);
    io->ground_um = (int32_t)draw(fuzz);
    check(host_tick(&fuzz->host, fuzz->micros, bytes, length) <= sizeof io->tx, "sent more than there is room for");
    if (io->reboot) {
        add_up(fuzz);
        host_power_on(&fuzz->host, fuzz->micros);
    }
}

static void check_understands(struct fuzz *fuzz)
{
    mavlink_ping_t ping = {fuzz->micros, 0xABCD1234UL, 0, 0};
    uint8_t payload[LARGEST] = {0}, frame[LARGEST + 32];
    uint32_t good, i;
    uint8_t length;

    memcpy(payload, &ping, MAVLINK_MSG_ID_PING_LEN);
    for (i = 0; i < 5; i++) { /* 20 ms of silence end whatever was begun */
        tick(fuzz, NULL, 0);
    }
    length = build(fuzz, frame, &rows[ROW_PING], payload);
    good = fuzz->host.robot.counters.good;
    tick(fuzz, frame, length);
    check(fuzz->host.robot.counters.good == good + 1, "the next good frame was not understood");
}

/* Nothing arms the robot here: its wheels must stand still. */
static void run_disarmed(struct fuzz *fuzz, uint32_t bytes)
{
    uint8_t chunk[CHUNK];
    uint32_t done = 0, rounds = 0;

    while (done < bytes) {
        uint32_t used = fill(fuzz, chunk);

        tick(fuzz, chunk, used);
        done += used;
        check(fuzz->host.robot.state == ROBOT_STATE_DISARMED || fuzz->host.robot.state == ROBOT_STATE_STOPPED,
              "armed by damaged bytes");
        check(fuzz->host.io.wheel[0] == 0 && fuzz->host.io.wheel[1] == 0, "wheels turn while disarmed");
        if (++rounds % 50 == 0) {
            check_understands(fuzz);
        }
    }
}

/* Armed and in session all the time, so that motion, memory and contest run on whatever comes. */
static void run_armed(struct fuzz *fuzz, uint32_t bytes)
{
    uint8_t chunk[CHUNK], payload[LARGEST], frame[LARGEST + 32];
    mavlink_command_long_t arm = {1.0f, 0, 0, 0, 0, 0, 0, MAV_CMD_COMPONENT_ARM_DISARM, 1, 1, 0};
    mavlink_robot_session_t session = {0x0101, 0, 1, 1, PROTOCOL_MAJOR, PROTOCOL_MINOR};
    mavlink_junior_maneuver_t maneuver = {0x0101, 0, 20, 15, 1, 1, 8, {5, 6, 7, 8, 9, 10, 11, 12}};
    mavlink_junior_contest_t contest = {0x0101, 0, 10, 1, 1, 1};
    uint32_t done = 0;
    uint16_t number = 0;

    while (done < bytes) {
        uint32_t used;

        if (fuzz->host.robot.state == ROBOT_STATE_STOPPED || !fuzz->host.robot.session.open
            || fuzz->host.robot.session.id != session.session) {
            memset(payload, 0, sizeof payload);
            memcpy(payload, &session, MAVLINK_MSG_ID_ROBOT_SESSION_LEN);
            tick(fuzz, frame, build(fuzz, frame, &rows[ROW_ROBOT_SESSION], payload));
            arm.param1 = 0.0f;
            memcpy(payload, &arm, MAVLINK_MSG_ID_COMMAND_LONG_LEN);
            tick(fuzz, frame, build(fuzz, frame, &rows[ROW_COMMAND_LONG], payload));
            number = fuzz->host.robot.session.last;
        }
        arm.param1 = 1.0f;
        memcpy(payload, &arm, MAVLINK_MSG_ID_COMMAND_LONG_LEN);
        tick(fuzz, frame, build(fuzz, frame, &rows[ROW_COMMAND_LONG], payload));
        maneuver.sequence = ++number;
        memcpy(payload, &maneuver, MAVLINK_MSG_ID_JUNIOR_MANEUVER_LEN);
        tick(fuzz, frame, build(fuzz, frame, &rows[ROW_JUNIOR_MANEUVER], payload));
        if (draw(fuzz) % 16 == 0) {
            contest.sequence = ++number;
            memcpy(payload, &contest, MAVLINK_MSG_ID_JUNIOR_CONTEST_LEN);
            tick(fuzz, frame, build(fuzz, frame, &rows[ROW_JUNIOR_CONTEST], payload));
        }
        used = fill(fuzz, chunk);
        tick(fuzz, chunk, used);
        done += used;
        check(fuzz->host.io.wheel[0] >= -1000 && fuzz->host.io.wheel[0] <= 1000 && fuzz->host.io.wheel[1] >= -1000
                  && fuzz->host.io.wheel[1] <= 1000,
              "more effort than there is");
    }
    add_up(fuzz);
    check(fuzz->total.maneuvers > 1000, "hardly a maneuver was performed: this fuzzes less than it should");
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
    uint16_t identifier = (uint16_t)(CAN_FUNCTION_TRANSFER_DOWN << 7 | (draw(fuzz) % 8 ? 1 : 0));
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
        if (damage && draw(fuzz) % 8 == 0) {
            frame[draw(fuzz) % (size + 1U)] ^= (uint8_t)(1U << draw(fuzz) % 8);
        }
        if (damage && draw(fuzz) % 16 == 0) {
            continue;
        }
        used += record(chunk + used, identifier, (uint8_t)(damage && draw(fuzz) % 16 == 0 ? draw(fuzz) % 9 : size + 1U), frame);
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
        const struct row *row = &rows[draw(fuzz) % INBOUND_COUNT];
        uint16_t command = 511;

        for (i = 0; i < LARGEST; i++) {
            payload[i] = (uint8_t)(draw(fuzz) % 3 ? draw(fuzz) % 9 : draw(fuzz));
        }
        if (row->id == MAVLINK_MSG_ID_COMMAND_LONG) { /* nothing that arms */
            memcpy(payload + 28, &command, sizeof command);
        }
        if (row->id == MAVLINK_MSG_ID_PARAM_SET) {
            payload[0] = 0; /* no name of a parameter can begin like this: SYS_ID stays */
            memset(payload + 6, 0, 16);
        }
        used = transfer(fuzz, chunk, row, payload, draw(fuzz) % 2);
        for (i = 0; i < 8; i++) {
            payload[i] = (uint8_t)draw(fuzz);
        }
        used += record(chunk + used, (uint16_t)(draw(fuzz) % 2 ? draw(fuzz) % 0x800 : draw(fuzz) % 2 << 8 | 1),
                       (uint8_t)(draw(fuzz) % 9), payload);
        tick(fuzz, chunk, used);
        check(fuzz->host.io.wheel[0] == 0 && fuzz->host.io.wheel[1] == 0, "wheels turn while disarmed, over CAN");
        if (round % 50 == 0) {
            memset(payload, 0, sizeof payload);
            good = fuzz->host.robot.counters.good;
            used = transfer(fuzz, chunk, &rows[ROW_PING], payload, 0);
            tick(fuzz, chunk, used);
            check(fuzz->host.robot.counters.good == good + 1 || fuzz->host.io.reboot, "the next good transfer was not understood");
        }
    }
    check(fuzz->host.robot.counters.good > rounds / 4, "hardly a transfer was understood");
    printf("%lu rounds over CAN: good %lu, bad checksum %lu, unknown %lu, lost %lu\n", (unsigned long)rounds,
           (unsigned long)fuzz->host.robot.counters.good, (unsigned long)fuzz->host.robot.counters.bad_checksum,
           (unsigned long)fuzz->host.robot.counters.unknown, (unsigned long)fuzz->host.robot.counters.lost);
}

int main(int argc, char **argv)
{
    uint32_t bytes = argc > 1 ? (uint32_t)strtoul(argv[1], NULL, 10) : 1000000UL;
    static struct fuzz fuzz;

    fuzz.random = 2463534242UL;
    memset(fuzz.host.io.nvm, 0xFF, sizeof fuzz.host.io.nvm);
    fuzz.host.io.has_ground = 1;
    fuzz.host.io.has_encoders = 1;
    host_power_on(&fuzz.host, 0);
    run_disarmed(&fuzz, bytes);
    check_understands(&fuzz);
    run_armed(&fuzz, bytes);
    printf("%lu bytes disarmed, %lu armed: good %lu, bad checksum %lu, unknown %lu, maneuvers %lu, boots %u\n",
           (unsigned long)bytes, (unsigned long)bytes, (unsigned long)fuzz.total.good,
           (unsigned long)fuzz.total.bad_checksum, (unsigned long)fuzz.total.unknown, (unsigned long)fuzz.total.maneuvers,
           fuzz.total.boots);
    run_can(&fuzz, bytes / 20);
    return 0;
}
