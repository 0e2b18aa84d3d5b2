/* What the runs of the fuzz program share: chance, frames, control periods. */
#include "fuzz.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

uint32_t fuzz_draw(struct fuzz *fuzz) /* xorshift32 (Marsaglia 2003) */
{
    fuzz->random ^= fuzz->random << 13;
    fuzz->random ^= fuzz->random >> 17;
    fuzz->random ^= fuzz->random << 5;
    return fuzz->random;
}

void fuzz_check(int good, const char *what)
{
    if (!good) {
        fprintf(stderr, "fuzz: %s\n", what);
        exit(1);
    }
}

#define ROW(name, id, base, length, crc_extra, system_at, component_at) {id, length, crc_extra, system_at, component_at},
const struct row fuzz_rows[] = {INBOUND_TABLE(ROW) JUNIOR_INBOUND_TABLE(ROW) MICRO_INBOUND_TABLE(ROW) SIGNING_TABLE(ROW)};
#undef ROW

uint8_t fuzz_build(struct fuzz *fuzz, uint8_t *frame, const struct row *row, const uint8_t *payload)
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
uint8_t fuzz_random_frame(struct fuzz *fuzz, uint8_t *frame)
{
    const struct row *row = &fuzz_rows[fuzz_draw(fuzz) % FUZZ_UNSIGNED];
    uint8_t payload[LARGEST] = {0};
    uint8_t i;

    for (i = 0; i < row->length; i++) {
        payload[i] = (uint8_t)(fuzz_draw(fuzz) % 3 == 0 ? fuzz_draw(fuzz) : fuzz_draw(fuzz) % 9);
    }
    if (row->system_at != 255) {
        payload[row->system_at] = fuzz_draw(fuzz) % 8 ? 1 : (uint8_t)fuzz_draw(fuzz);
    }
    if (row->component_at != 255) {
        payload[row->component_at] = fuzz_draw(fuzz) % 8 ? 1 : (uint8_t)fuzz_draw(fuzz);
    }
    if (row->id == MAVLINK_MSG_ID_COMMAND_LONG) {
        static const uint16_t commands[] = {185, 246, 511, 512, 99};
        uint16_t command = commands[fuzz_draw(fuzz) % 5];
        float number = (float)(fuzz_draw(fuzz) % 3);

        memcpy(payload + 28, &command, sizeof command);
        if (fuzz_draw(fuzz) % 2) {
            memcpy(payload, &number, sizeof number);
        }
    }
    return fuzz_build(fuzz, frame, row, payload);
}

void fuzz_add_up(struct fuzz *fuzz)
{
    const struct counters *counters = &fuzz->host.as.robot.counters;

    fuzz->total.good += counters->good;
    fuzz->total.bad_checksum += counters->bad_checksum;
    fuzz->total.unknown += counters->unknown;
    fuzz->total.maneuvers += counters->maneuvers;
    fuzz->total.boots = counters->boots;
}

enum { NEIGHBOURS = 20 };

/* What a micro-robot senses. */
static void sense(struct fuzz *fuzz)
{
    static uint8_t groups[NEIGHBOURS];
    static uint16_t bearings[NEIGHBOURS];
    static uint32_t distances[NEIGHBOURS];
    host_io *io = &fuzz->host.io;
    uint8_t i;

    for (i = 0; i < NEIGHBOURS; i++) {
        groups[i] = (uint8_t)(fuzz_draw(fuzz) % 3);
        bearings[i] = (uint16_t)fuzz_draw(fuzz);
        distances[i] = fuzz_draw(fuzz) % 2 ? fuzz_draw(fuzz) : fuzz_draw(fuzz) % 1000000;
    }
    host_see(&fuzz->host, fuzz_draw(fuzz) % NEIGHBOURS, groups, bearings, distances);
    io->bump = (uint8_t)(fuzz_draw(fuzz) % 4 ? 0 : fuzz_draw(fuzz));
    io->ready = fuzz_draw(fuzz) % 4 != 0;
    io->fix_new = fuzz_draw(fuzz) % 8 == 0;
    io->fix_um[0] = (int32_t)fuzz_draw(fuzz) / 64; /* 33 m */
    io->fix_um[1] = (int32_t)fuzz_draw(fuzz) / 64;
    io->fix_heading = (uint16_t)fuzz_draw(fuzz);
    io->fix_age = (uint16_t)(fuzz_draw(fuzz) % 2000);
    io->range[fuzz_draw(fuzz) % 32] = (uint16_t)fuzz_draw(fuzz);
    io->has_box = io->has_goal = fuzz_draw(fuzz) % 2;
}

void fuzz_tick(struct fuzz *fuzz, const uint8_t *bytes, uint32_t length)
{
    host_io *io = &fuzz->host.io;

    fuzz->micros += TICK_US;
    io->eye[0] = (uint16_t)(fuzz_draw(fuzz) % 1024);
    io->eye[1] = (uint16_t)(fuzz_draw(fuzz) % 1024);
    io->floor[0] = (uint16_t)(fuzz_draw(fuzz) % 1024);
    io->floor[1] = (uint16_t)(fuzz_draw(fuzz) % 1024);
    io->arm[0] = (uint8_t)(fuzz_draw(fuzz) % 2);
    io->arm[1] = (uint8_t)(fuzz_draw(fuzz) % 2);
    io->battery_mv = (uint16_t)fuzz_draw(fuzz);
    io->travel_um[0] = (int32_t)fuzz_draw(fuzz);
    io->travel_um[1] = (int32_t)fuzz_draw(fuzz);
    io->ground_um = (int32_t)fuzz_draw(fuzz);
    if (io->role == FUZZ_MICRO) {
        sense(fuzz);
    }
    fuzz_check(host_tick(&fuzz->host, fuzz->micros, bytes, length) <= sizeof io->tx, "sent more than there is room for");
    if (io->reboot) {
        fuzz_add_up(fuzz);
        host_power_on(&fuzz->host, fuzz->micros);
    }
}

void fuzz_check_understands(struct fuzz *fuzz)
{
    mavlink_ping_t ping = {fuzz->micros, 0xABCD1234UL, 0, 0};
    uint8_t payload[LARGEST] = {0}, frame[LARGEST + 32];
    uint32_t good, i;
    uint8_t length;

    memcpy(payload, &ping, MAVLINK_MSG_ID_PING_LEN);
    for (i = 0; i < 5; i++) { /* 20 ms of silence end whatever was begun */
        fuzz_tick(fuzz, NULL, 0);
    }
    length = fuzz_build(fuzz, frame, &fuzz_rows[ROW_PING], payload);
    good = fuzz->host.as.robot.counters.good;
    fuzz_tick(fuzz, frame, length);
    fuzz_check(fuzz->host.as.robot.counters.good == good + 1, "the next good frame was not understood");
}
