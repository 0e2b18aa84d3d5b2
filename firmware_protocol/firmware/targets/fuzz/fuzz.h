/* What the runs of the fuzz program share. */
#ifndef FIRMWARE_FUZZ_H
#define FIRMWARE_FUZZ_H

#include "core/core.h"
#include "host.h"

enum { TICK_US = 5000, HEADER = 10, CHECKSUM = 2, SIGNATURE = 13, LARGEST = 64, CHUNK = 200, FUZZ_FRAME = LARGEST + 32 };

struct fuzz {
    host_robot host;
    uint64_t micros;
    uint32_t random;
    uint8_t sequence;
    struct counters total; /* of all boots */
};

struct row {
    uint16_t id;
    uint8_t length, crc_extra, system_at, component_at;
};

/* What a robot of either role understands, and behind that what only one that can sign does. */
extern const struct row fuzz_rows[];
#define ROW(name, id, base, length, crc_extra, system_at, component_at) ROW_##name,
enum { INBOUND_TABLE(ROW) JUNIOR_INBOUND_TABLE(ROW) MICRO_INBOUND_TABLE(ROW) SIGNING_TABLE(ROW) FUZZ_ROWS }; /* where a message stands there */
#undef ROW

enum { FUZZ_JUNIOR = 0, FUZZ_MICRO = 2, FUZZ_UNSIGNED = ROW_SETUP_SIGNING /* rows before that */ };

uint32_t fuzz_draw(struct fuzz *fuzz); /* the next random number */
void fuzz_check(int good, const char *what); /* ends the program where it is not */
uint8_t fuzz_build(struct fuzz *fuzz, uint8_t *frame, const struct row *row, const uint8_t *payload); /* returns its length */
uint8_t fuzz_random_frame(struct fuzz *fuzz, uint8_t *frame);
void fuzz_add_up(struct fuzz *fuzz);
void fuzz_tick(struct fuzz *fuzz, const uint8_t *bytes, uint32_t length);
void fuzz_check_understands(struct fuzz *fuzz);

/* signed.c: frames signed, and not, of a robot that has a key. */
void fuzz_run_signed(struct fuzz *fuzz, uint32_t rounds);

#endif
