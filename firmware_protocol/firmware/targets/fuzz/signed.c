/* Frames of a robot that has a key: well signed, signed by somebody else, damaged, said before, and not signed.
 *
 * What nobody has signed with its key changes nothing but the counters, and the next frame that is well signed is heard.
 */
#include "fuzz.h"

#include <stdio.h>
#include <string.h>

enum { KEY_SIZE = SIGNING_KEY_SIZE, HASH_SIZE = 6, FRAMES = 6, STREAMS_USED = 6 };

struct keyed {
    struct fuzz *fuzz;
    uint8_t key[KEY_SIZE];
    uint64_t time; /* of the last signature: 10 us since 2015 */
    uint32_t not_signed, bad, replayed, keys;
};

static const uint64_t begin = 30000000000000ULL; /* 2024, about */

/* Makes a frame a signed one; returns its new length. */
static uint8_t seal(uint8_t *frame, const uint8_t *key, uint8_t link, uint64_t time)
{
    uint8_t length = (uint8_t)(HEADER + frame[1]), i, row = 0;
    uint16_t crc = 0xFFFF, id = (uint16_t)(frame[7] | frame[8] << 8);
    struct sha256 hash;

    while (fuzz_rows[row].id != id) {
        row++;
    }
    frame[2] = 1;
    for (i = 1; i < length; i++) {
        crc = wire_crc(crc, frame[i]);
    }
    crc = wire_crc(crc, fuzz_rows[row].crc_extra);
    frame[length++] = (uint8_t)crc;
    frame[length++] = (uint8_t)(crc >> 8);
    frame[length++] = link;
    for (i = 0; i < 6; i++) {
        frame[length++] = (uint8_t)(time >> 8 * i);
    }
    sha256_begin(&hash);
    for (i = 0; i < KEY_SIZE; i++) {
        sha256_add(&hash, key[i]);
    }
    for (i = 0; i < length; i++) {
        sha256_add(&hash, frame[i]);
    }
    sha256_end(&hash, frame + length, HASH_SIZE);
    return (uint8_t)(length + HASH_SIZE);
}

/* A time that the robot believes of anybody: later than its own and than all it has heard. */
static uint64_t news(struct keyed *keyed, uint32_t ahead)
{
    const struct stamp *now = &keyed->fuzz->host.as.robot.signing.now;
    uint64_t own = (uint64_t)now->high << 16 | now->low;

    keyed->time = (own > keyed->time ? own : keyed->time) + 1 + ahead;
    return keyed->time;
}

static uint8_t random_seal(struct keyed *keyed, uint8_t *frame)
{
    struct fuzz *fuzz = keyed->fuzz;
    uint8_t other[KEY_SIZE], length = fuzz_random_frame(fuzz, frame), i;
    uint8_t link = (uint8_t)(fuzz_draw(fuzz) % 8 ? 0 : fuzz_draw(fuzz) % STREAMS_USED);

    if (fuzz_draw(fuzz) % 8 == 0) {
        frame[5] = (uint8_t)(250 + fuzz_draw(fuzz) % STREAMS_USED);
    }
    switch (fuzz_draw(fuzz) % 8) {
    case 0: /* not signed */
        return length;
    case 1: /* by somebody else */
        memcpy(other, keyed->key, KEY_SIZE);
        other[fuzz_draw(fuzz) % KEY_SIZE] ^= (uint8_t)(1U << fuzz_draw(fuzz) % 8);
        return seal(frame, other, link, news(keyed, 0));
    case 2: /* said before, or long ago */
        return seal(frame, keyed->key, link, keyed->time - fuzz_draw(fuzz) % (fuzz_draw(fuzz) % 2 ? 3U : 20000000U));
    case 3: /* ahead, by an hour at most: what is stored must keep up */
        return seal(frame, keyed->key, link, news(keyed, fuzz_draw(fuzz) % 360000000U));
    case 4: /* damaged anywhere, and by that a bad checksum or a wrong signature */
        length = seal(frame, keyed->key, link, news(keyed, 0));
        for (i = 0; i <= fuzz_draw(fuzz) % 3; i++) {
            frame[fuzz_draw(fuzz) % length] ^= (uint8_t)(1U << fuzz_draw(fuzz) % 8);
        }
        return length;
    case 5: /* broken off, most often within the signature */
        length = seal(frame, keyed->key, link, news(keyed, 0));
        return (uint8_t)(length - 1 - fuzz_draw(fuzz) % (fuzz_draw(fuzz) % 4 ? SIGNATURE : length));
    default:
        return seal(frame, keyed->key, link, news(keyed, fuzz_draw(fuzz) % 2000));
    }
}

static uint8_t ping(struct keyed *keyed, uint8_t *frame)
{
    uint8_t payload[LARGEST] = {0};

    payload[8] = 1;
    return fuzz_build(keyed->fuzz, frame, &fuzz_rows[ROW_PING], payload);
}

/* The counters are those of this boot. */
static void count(struct keyed *keyed)
{
    const struct signing *signing = &keyed->fuzz->host.as.robot.signing;

    keyed->not_signed += signing->not_signed;
    keyed->bad += signing->bad;
    keyed->replayed += signing->replayed;
}

static void restart(struct keyed *keyed)
{
    count(keyed);
    host_power_on(&keyed->fuzz->host, keyed->fuzz->micros);
}

static void check_judges(struct keyed *keyed)
{
    struct fuzz *fuzz = keyed->fuzz;
    const struct robot *robot = &fuzz->host.as.robot;
    uint8_t frame[FUZZ_FRAME], copy[FUZZ_FRAME], length, i;
    uint32_t good;

    for (i = 0; i < 120; i++) { /* whatever was begun ends, and what is being stored is stored */
        fuzz_tick(fuzz, NULL, 0);
    }
    fuzz_check(robot->signing.on, "the key is gone");
    good = robot->counters.good;
    fuzz_tick(fuzz, frame, ping(keyed, frame));
    fuzz_check(robot->counters.good == good, "believed what nobody has signed");
    ping(keyed, frame);
    length = seal(frame, keyed->key, 0, news(keyed, 0));
    memcpy(copy, frame, length);
    copy[length - 1 - fuzz_draw(fuzz) % HASH_SIZE] ^= (uint8_t)(1U << fuzz_draw(fuzz) % 8);
    fuzz_tick(fuzz, copy, length);
    for (i = 0; i < 5; i++) { /* a wrong signature may hide the beginning of a frame: silence ends that */
        fuzz_tick(fuzz, NULL, 0);
    }
    fuzz_check(robot->counters.good == good, "believed a wrong signature");
    fuzz_tick(fuzz, frame, length);
    for (i = 0; i < 120 && robot->counters.good == good; i++) { /* its time may have to be stored before */
        fuzz_tick(fuzz, frame, length);
    }
    fuzz_check(robot->counters.good == good + 1, "the next frame that was well signed was not believed");
    fuzz_tick(fuzz, frame, length);
    fuzz_check(robot->counters.good == good + 1, "believed the same frame twice");
}

/* Another key, given over the line; what fuzz_random_frame has said may have stopped the robot: it takes none then. */
static void change_key(struct keyed *keyed)
{
    struct fuzz *fuzz = keyed->fuzz;
    mavlink_setup_signing_t setup;
    uint8_t payload[LARGEST] = {0}, frame[FUZZ_FRAME], i;

    restart(keyed);
    memset(&setup, 0, sizeof setup);
    setup.target_system = 1;
    setup.target_component = 1;
    setup.initial_timestamp = fuzz_draw(fuzz) % 2 ? keyed->time + fuzz_draw(fuzz) % 1000 : 0;
    for (i = 0; i < KEY_SIZE; i++) {
        setup.secret_key[i] = (uint8_t)(fuzz_draw(fuzz) | 1U);
    }
    memcpy(payload, &setup, MAVLINK_MSG_ID_SETUP_SIGNING_LEN);
    fuzz_build(fuzz, frame, &fuzz_rows[ROW_SETUP_SIGNING], payload);
    fuzz_tick(fuzz, frame, seal(frame, keyed->key, 0, news(keyed, 0)));
    for (i = 0; i < 120; i++) {
        fuzz_tick(fuzz, NULL, 0);
    }
    memcpy(keyed->key, setup.secret_key, KEY_SIZE);
    keyed->keys++;
}

void fuzz_run_signed(struct fuzz *fuzz, uint32_t rounds)
{
    struct keyed keyed = {0};
    uint8_t chunk[FRAMES * FUZZ_FRAME];
    uint32_t round, used;
    uint8_t i;

    keyed.fuzz = fuzz;
    keyed.time = begin;
    for (i = 0; i < KEY_SIZE; i++) {
        keyed.key[i] = (uint8_t)(i + 1);
    }
    fuzz->host.io.can = 0;
    memset(fuzz->host.io.nvm, 0xFF, sizeof fuzz->host.io.nvm);
    host_give_key(&fuzz->host, keyed.key);
    host_power_on(&fuzz->host, fuzz->micros);
    for (round = 0; round < rounds; round++) {
        used = 0;
        for (i = 0; i < FRAMES; i++) {
            used += random_seal(&keyed, chunk + used);
        }
        fuzz_tick(fuzz, chunk, used);
        fuzz_check(fuzz->host.io.wheel[0] == 0 && fuzz->host.io.wheel[1] == 0, "wheels turn while disarmed, with a key");
        switch (round % 64) {
        case 15:
            host_slow_down(&fuzz->host, 1, 0, 0);
            break;
        case 31:
            host_slow_down(&fuzz->host, 0, 0, 0);
            check_judges(&keyed);
            break;
        case 47:
            restart(&keyed);
            break;
        case 63:
            change_key(&keyed);
            check_judges(&keyed);
            break;
        default:
            break;
        }
    }
    count(&keyed);
    fuzz_check(keyed.not_signed > rounds / 4 && keyed.bad > rounds / 4 && keyed.replayed > rounds / 4,
               "hardly a frame was refused: this fuzzes less than it should");
    printf("%lu rounds with a key: not signed %lu, wrongly signed %lu, replayed %lu, keys %lu\n", (unsigned long)rounds,
           (unsigned long)keyed.not_signed, (unsigned long)keyed.bad, (unsigned long)keyed.replayed,
           (unsigned long)keyed.keys);
}
