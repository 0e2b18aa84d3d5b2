/* MAVLink 2 signing: with a key, what the robot says is signed, and only what is signed is believed, once.
 *
 * Time is in 10 us since 2015. A robot has no calendar: its time starts at what is stored, goes with its clock, and is put
 * forward to what believed frames say. What is stored lies ahead of every time used so far, and is written before a frame
 * beyond it is believed: so a robot that was switched off believes nothing that it may have believed before.
 *
 * No time lies beyond LIMIT: what is signed there is refused, and our own time stops there. Else one frame from the end of
 * the 48 bits would shut out everybody, and for ever. What has come near it nevertheless is forgotten, but not the key, when
 * the robot is switched on with its start input held: on at power-on, and still on when the boot has been counted, 20 ms or
 * more later on an EEPROM. Whatever the input does then, the role looks at it as ever.
 *
 * The key is kept twice, each with a checksum and a mark. The first copy is written first: a cut leaves the old key or the
 * new one. It is read from there whenever it is needed, and is nowhere in working memory.
 */
#include "core/core.h"

#if FIRMWARE_SIGNING

enum {
    KEY = SIGNING_KEY_SIZE,
    AT_CRC = KEY,
    AT_MARK = KEY + 2,
    WRITTEN = 0,
    AT_FLAGS = 2,
    AT_SYSTEM = 5,
    FLAG_SIGNED = 1,
    SIGNATURE = 13,
    HASH = 6,
    TIME = 6,
    PER_MS = 100,
    OLDEST = 92,  /* 0.66 s: one minute */
    AHEAD = 458,  /* how far ahead time is stored: 300 s */
    MARGIN = 46,  /* and how far it is kept ahead: 30 s */
};

#define LIMIT 4092978515U /* of a time's upper 32 bits: 2100-01-01 GMT, which is 0.41 s after they come to this */

typedef char signing_fits[(RECORD_PARAMS + PARAMS_MOST) <= RECORD_SIGNED ? 1 : -1];

static uint8_t key_byte(struct robot *robot, uint8_t slot, uint8_t at)
{
    return hal_nvm_read(robot->board, (uint16_t)(SIGNING_ADDRESS + slot * SIGNING_SLOT_SIZE + at));
}

static uint16_t key_crc(struct robot *robot, uint8_t slot, bool *zero)
{
    uint16_t crc = 0xFFFF;
    uint8_t i;

    *zero = true;
    for (i = 0; i < KEY; i++) {
        uint8_t byte = key_byte(robot, slot, i);

        *zero = *zero && byte == 0;
        crc = wire_crc(crc, byte);
    }
    return crc;
}

static bool intact(struct robot *robot, uint8_t slot)
{
    bool zero;
    uint16_t crc = key_crc(robot, slot, &zero);

    return key_byte(robot, slot, AT_MARK) == WRITTEN && key_byte(robot, slot, AT_CRC) == (uint8_t)crc
           && key_byte(robot, slot, AT_CRC + 1) == (uint8_t)(crc >> 8);
}

static bool differ(struct robot *robot)
{
    uint8_t i;

    for (i = 0; i < KEY; i++) {
        if (key_byte(robot, 0, i) != key_byte(robot, 1, i)) {
            return true;
        }
    }
    return false;
}

/* The caller has put the key into nvm.data. */
static void write_key(struct robot *robot, uint8_t slot)
{
    uint8_t *data = robot->nvm.data;
    uint16_t crc = 0xFFFF;
    uint8_t i;

    for (i = 0; i < KEY; i++) {
        crc = wire_crc(crc, data[i]);
    }
    data[AT_CRC] = (uint8_t)crc;
    data[AT_CRC + 1] = (uint8_t)(crc >> 8);
    data[AT_MARK] = WRITTEN;
    nvm_begin(robot, (uint16_t)(SIGNING_ADDRESS + slot * SIGNING_SLOT_SIZE), SIGNING_SLOT_SIZE);
}

static void copy_key(struct robot *robot, uint8_t from, uint8_t to)
{
    uint8_t i;

    for (i = 0; i < KEY; i++) {
        robot->nvm.data[i] = key_byte(robot, from, i);
    }
    write_key(robot, to);
}

/* From now on the key in this copy counts; nothing signed before now is believed. */
static void use_key(struct robot *robot, uint8_t slot)
{
    bool zero;

    key_crc(robot, slot, &zero);
    robot->signing.slot = slot;
    robot->signing.on = !zero;
    robot->signing.floor = robot->signing.now;
    robot->signing.used = 0;
}

static uint32_t capped(uint32_t high)
{
    return high < LIMIT ? high : LIMIT;
}

/* Time that has come as far as `high`, which is LIMIT at most. */
static void store_time(struct robot *robot, uint32_t high)
{
    uint8_t bytes[4];

    robot->signing.pending = capped(high + AHEAD);
    memcpy(bytes, &robot->signing.pending, sizeof bytes);
    nvm_record_write(robot, RECORD_SIGNED, 0xFFFF, bytes);
}

static bool later(const struct stamp *a, const struct stamp *b)
{
    return a->high != b->high ? a->high > b->high : a->low > b->low;
}

static void advance(struct stamp *stamp, uint32_t by)
{
    by += stamp->low;
    stamp->low = (uint16_t)by;
    stamp->high += by >> 16;
    stamp->high = capped(stamp->high); /* there nothing is believed, whatever the lower bits */
}

void signing_start(struct robot *robot, bool held)
{
    struct signing *signing = &robot->signing;
    uint8_t bytes[4];
    uint8_t slot;

    if (hal_start(robot->board) == 0) {
        held = false; /* a spike */
    }
    if (!held && nvm_record_read(robot, RECORD_SIGNED, 0xFFFF, bytes) == RECORD_GOOD) {
        memcpy(&signing->durable, bytes, sizeof bytes);
        signing->durable = capped(signing->durable);
    }
    signing->pending = signing->durable;
    signing->now.high = signing->durable;
    for (slot = 0; slot < 2 && !intact(robot, slot); slot++) {
    }
    if (slot == 2) {
        return; /* no key was ever given */
    }
    use_key(robot, slot);
    if (!intact(robot, slot ^ 1) || differ(robot)) { /* what a cut has left */
        copy_key(robot, slot, slot ^ 1);
        nvm_flush(robot);
    }
    signing->slot = 0;
    if (signing->on || held) { /* a cut meanwhile leaves the time as it was, or this one */
        store_time(robot, signing->durable);
        nvm_flush(robot);
        signing->durable = signing->pending;
    }
}

/* Time passes. */
void signing_tick(struct robot *robot)
{
    advance(&robot->signing.now, (uint32_t)robot->time.elapsed * PER_MS);
}

/* Goes on with storing. */
void signing_step(struct robot *robot)
{
    struct signing *signing = &robot->signing;

    if (!nvm_idle(robot)) {
        return;
    }
    signing->durable = signing->pending;
    switch (signing->job) {
    case SIGNING_FIRST_COPY:
        if (intact(robot, 0)) {
            use_key(robot, 0);
            copy_key(robot, 0, 1);
            signing->job = SIGNING_SECOND_COPY;
        } else { /* worn out: the key before goes on */
            signing->job = SIGNING_IDLE;
        }
        break;
    case SIGNING_SECOND_COPY:
        signing->job = SIGNING_IDLE;
        break;
    default:
        if (signing->on && signing->now.high + MARGIN >= signing->durable) {
            store_time(robot, signing->now.high);
        }
        break;
    }
}

/* While disarmed, of one it believes or while it believes everybody. What comes while something is stored is not heard. */
void signing_setup(struct robot *robot, const mavlink_setup_signing_t *setup)
{
    struct signing *signing = &robot->signing;
    uint32_t parts[2];
    struct stamp initial;

    if (robot->state != ROBOT_STATE_DISARMED || signing->job != SIGNING_IDLE || !nvm_idle(robot)) {
        return;
    }
    memcpy(parts, &setup->initial_timestamp, sizeof parts);
    initial.high = parts[0] >> 16 | parts[1] << 16;
    initial.low = (uint16_t)parts[0];
    if (parts[1] >> 16 == 0 && initial.high < LIMIT && later(&initial, &signing->now)) {
        signing->now = initial;
    }
    signing->slot = 1; /* the first copy is being written */
    signing->job = SIGNING_FIRST_COPY;
    memcpy(robot->nvm.data, setup->secret_key, KEY);
    write_key(robot, 0);
}

static void hash_key(struct robot *robot, struct sha256 *hash)
{
    uint8_t i;

    sha256_begin(hash);
    for (i = 0; i < KEY; i++) {
        sha256_add(hash, key_byte(robot, robot->signing.slot, i));
    }
}

static void hash_bytes(struct sha256 *hash, const uint8_t *bytes, uint8_t length)
{
    while (length-- > 0) {
        sha256_add(hash, *bytes++);
    }
}

static void count(uint16_t *counter)
{
    if (*counter != UINT16_MAX) {
        ++*counter;
    }
}

static bool same_hash(struct robot *robot, const uint8_t *frame, uint8_t length)
{
    struct sha256 hash;
    uint8_t expected[HASH], difference = 0, i;

    hash_key(robot, &hash);
    hash_bytes(&hash, frame, (uint8_t)(length - HASH));
    sha256_end(&hash, expected, HASH);
    for (i = 0; i < HASH; i++) { /* all of them: how long it takes tells nothing */
        difference |= expected[i] ^ frame[length - HASH + i];
    }
    return difference == 0;
}

/* A time that what is stored lies ahead of, now if it must. */
static bool covered(struct robot *robot, uint32_t high)
{
    struct signing *signing = &robot->signing;

    if (high >= signing->durable && nvm_idle(robot)) {
        store_time(robot, high);
        if (nvm_idle(robot)) {
            signing->durable = signing->pending;
        }
    }
    return high < signing->durable;
}

/* Where this stream is noted, or may be: instead of the one that is furthest behind, which then must be news to be heard. */
static struct signed_stream *place_for(struct signing *signing)
{
    struct signed_stream *oldest = signing->streams;
    uint8_t i;

    if (signing->used < SIGNED_STREAMS) {
        return &signing->streams[signing->used++];
    }
    for (i = 1; i < SIGNED_STREAMS; i++) {
        if (later(&oldest->last, &signing->streams[i].last)) {
            oldest = &signing->streams[i];
        }
    }
    if (later(&oldest->last, &signing->floor)) {
        signing->floor = oldest->last;
    }
    return oldest;
}

uint8_t signing_judge(struct robot *robot, const uint8_t *frame, uint8_t length)
{
    struct signing *signing = &robot->signing;
    const uint8_t *signature = frame + length - SIGNATURE;
    struct signed_stream *stream = NULL;
    struct stamp time;
    uint8_t i;

    if (!(frame[AT_FLAGS] & FLAG_SIGNED)) {
        count(&signing->not_signed);
        return SIGNING_REFUSED;
    }
    if (!same_hash(robot, frame, length)) {
        count(&signing->bad);
        return SIGNING_WRONG;
    }
    memcpy(&time.low, signature + 1, sizeof time.low);
    memcpy(&time.high, signature + 1 + sizeof time.low, sizeof time.high);
    for (i = 0; i < signing->used; i++) {
        if (memcmp(signing->streams[i].sender, frame + AT_SYSTEM, 2) == 0 && signing->streams[i].link == signature[0]) {
            stream = &signing->streams[i];
        }
    }
    if (!later(&time, stream != NULL ? &stream->last : &signing->floor)
        || (stream == NULL && signing->now.high > OLDEST && time.high < signing->now.high - OLDEST)
        || time.high >= LIMIT
        || !covered(robot, time.high)) { /* it is being stored: what is sent again is believed */
        count(&signing->replayed);
        return SIGNING_REFUSED;
    }
    if (stream == NULL) {
        stream = place_for(signing);
        memcpy(stream->sender, frame + AT_SYSTEM, 2);
        stream->link = signature[0];
    }
    stream->last = time;
    if (later(&time, &signing->now)) {
        signing->now = time;
    }
    return SIGNING_BELIEVED;
}

void signing_sign(struct robot *robot, const uint8_t *header, const uint8_t *payload, uint8_t length,
                  const uint8_t *checksum, uint8_t *signature)
{
    struct sha256 hash;

    signature[0] = 0; /* our only link */
    memcpy(signature + 1, &robot->signing.now.low, sizeof robot->signing.now.low);
    memcpy(signature + 1 + sizeof robot->signing.now.low, &robot->signing.now.high, sizeof robot->signing.now.high);
    advance(&robot->signing.now, 1);
    hash_key(robot, &hash);
    hash_bytes(&hash, header, 10);
    hash_bytes(&hash, payload, length);
    hash_bytes(&hash, checksum, 2);
    hash_bytes(&hash, signature, 1 + TIME);
    sha256_end(&hash, signature + 1 + TIME, HASH);
}

/* This control period has lasted too long already: hashing takes longer than the line on a small machine. */
bool signing_late(struct robot *robot)
{
    return robot->signing.on && hal_used(robot->board) >= TICK_MS * 1000U;
}

#else
typedef int signing_is_not_compiled_in; /* C99 has no empty file */
#endif
