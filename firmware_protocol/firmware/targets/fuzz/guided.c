/* A target for libFuzzer, which is led by what is covered: `make fuzz-guided`, and `fuzz_seeds.py` for where it begins.
 *
 * An input is a mode and steps; checksums and signatures are made here, since chance never finds them. Whatever the steps
 * are: wheels turn in the states that move alone, no more is sent than there is room for, and no sanitizer objects.
 */
#include <stdlib.h>
#include <string.h>

#include "core/core.h"
#include "host.h"

enum { TICK_US = 5000, HEADER = 10, HASH_SIZE = 6, LARGEST = 64, FRAME = LARGEST + 32, KEY_SIZE = SIGNING_KEY_SIZE };
enum mode { MODE_CAN = 1, MODE_KEY = 2, MODE_SLOW = 4, MODE_BUSY = 8, MODE_SPOILT = 16, MODE_MICRO = 32 };
enum step { STEP_MESSAGE, STEP_SIGNED, STEP_BAD_SIGNED, STEP_RAW, STEP_TIME, STEP_SENSORS, STEP_POWER, STEP_TICK, STEPS };

struct row {
    uint16_t id;
    uint8_t length, crc_extra;
};

#define ROW(name, id, base, length, crc_extra, system_at, component_at) {id, length, crc_extra},
static const struct row rows[] = {INBOUND_TABLE(ROW) JUNIOR_INBOUND_TABLE(ROW) MICRO_INBOUND_TABLE(ROW) SIGNING_TABLE(ROW)};
#undef ROW
enum { ROWS = sizeof rows / sizeof rows[0] };

enum { NEIGHBOURS = 4 };

struct guided {
    host_robot host;
    uint64_t micros, time;
    uint8_t mode, sequence;
    const uint8_t *data;
    size_t left;
    uint8_t rx[1024];
    uint32_t rx_len;
    uint8_t groups[NEIGHBOURS];
    uint16_t bearings[NEIGHBOURS];
    uint32_t distances[NEIGHBOURS]; /* of those that a micro-robot's ring finds */
};

static uint8_t take(struct guided *guided)
{
    if (guided->left == 0) {
        return 0;
    }
    guided->left--;
    return *guided->data++;
}

static void check(int good)
{
    if (!good) {
        abort();
    }
}

static void tick(struct guided *guided)
{
    host_io *io = &guided->host.io;
    uint8_t state;

    guided->micros += TICK_US;
    check(host_tick(&guided->host, guided->micros, guided->rx, guided->rx_len) <= sizeof io->tx);
    guided->rx_len = 0;
    state = host_state(&guided->host);
    check(state < ROBOT_STATE_ENUM_END);
    check(io->wheel[0] >= -1000 && io->wheel[0] <= 1000 && io->wheel[1] >= -1000 && io->wheel[1] <= 1000);
    if (state != ROBOT_STATE_DRIVING && state != ROBOT_STATE_PERFORMING && state != ROBOT_STATE_CONTEST) {
        check(io->wheel[0] == 0 && io->wheel[1] == 0);
    }
    if (io->reboot) {
        host_power_on(&guided->host, guided->micros);
    }
}

static void receive(struct guided *guided, const uint8_t *bytes, uint32_t length)
{
    if (guided->rx_len + length > sizeof guided->rx) {
        tick(guided);
    }
    memcpy(guided->rx + guided->rx_len, bytes, length);
    guided->rx_len += length;
}

/* On a bus, the same bytes are a frame. */
static void receive_frame(struct guided *guided, uint16_t identifier, const uint8_t *data, uint8_t length)
{
    uint8_t record[16] = {0};

    record[0] = (uint8_t)identifier;
    record[1] = (uint8_t)(identifier >> 8);
    record[4] = length;
    memcpy(record + 8, data, length);
    receive(guided, record, sizeof record);
}

static void receive_transfer(struct guided *guided, const struct row *row, const uint8_t *payload)
{
    static const struct {
        uint16_t id;
        uint8_t length, crc_extra, cut_at, cut;
    } table[] = {
#define ROW(name, id, length, crc_extra, cut_at, cut, inbound) {id, length, crc_extra, cut_at, cut},
        CAN_TABLE(ROW) JUNIOR_CAN_TABLE(ROW) MICRO_CAN_TABLE(ROW)
#undef ROW
    };
    uint8_t data[LARGEST + 8], frame[8], at = 3, i, k = 0, size;
    uint16_t crc = 0xFFFF;

    while (k < sizeof table / sizeof table[0] && table[k].id != row->id) {
        k++;
    }
    if (k == sizeof table / sizeof table[0]) {
        return;
    }
    for (i = 0; i < row->length; i++) {
        if (i < table[k].cut_at || i >= table[k].cut_at + table[k].cut) {
            data[at++] = payload[i];
        }
    }
    data[0] = (uint8_t)row->id;
    data[1] = (uint8_t)(row->id >> 8);
    data[2] = (uint8_t)(at - 3);
    for (i = 0; i < at; i++) {
        crc = wire_crc(crc, data[i]);
    }
    crc = wire_crc(crc, row->crc_extra);
    data[at++] = (uint8_t)crc;
    data[at++] = (uint8_t)(crc >> 8);
    for (i = 0; i * 7 < at; i++) {
        size = (uint8_t)(at - i * 7 < 7 ? at - i * 7 : 7);
        frame[0] = (uint8_t)(guided->sequence << 5 | i);
        memcpy(frame + 1, data + i * 7, size);
        receive_frame(guided, CAN_FUNCTION_TRANSFER_DOWN << 7 | 1, frame, (uint8_t)(size + 1));
    }
    guided->sequence++;
}

static uint8_t sign(struct guided *guided, uint8_t *frame, uint8_t length, uint8_t advance)
{
    struct sha256 hash;
    uint8_t i;

    guided->time += (uint64_t)1 << advance % 40;
    frame[length++] = 0;
    for (i = 0; i < 6; i++) {
        frame[length++] = (uint8_t)(guided->time >> 8 * i);
    }
    sha256_begin(&hash);
    for (i = 0; i < KEY_SIZE; i++) {
        sha256_add(&hash, (uint8_t)(i + 1));
    }
    for (i = 0; i < length; i++) {
        sha256_add(&hash, frame[i]);
    }
    sha256_end(&hash, frame + length, HASH_SIZE);
    return (uint8_t)(length + HASH_SIZE);
}

/* Message id (2 bytes), sender (1: most often the host), payload: as long as declared, a frame with a good checksum. */
static void message(struct guided *guided, uint8_t step)
{
    const struct row *row = &rows[ROWS - 1];
    uint16_t id = take(guided), crc = 0xFFFF;
    uint8_t frame[FRAME], length, sender, i;

    id = (uint16_t)(id | take(guided) << 8);
    sender = take(guided);
    for (i = 0; i < ROWS; i++) {
        if (rows[i].id == id) {
            row = &rows[i];
        }
    }
    frame[0] = 0xFD;
    frame[1] = row->length;
    frame[2] = step != STEP_MESSAGE;
    frame[3] = 0;
    frame[4] = guided->sequence;
    frame[5] = (uint8_t)(255 - sender % 4);
    frame[6] = 190;
    frame[7] = (uint8_t)row->id;
    frame[8] = (uint8_t)(row->id >> 8);
    frame[9] = 0;
    for (i = 0; i < row->length; i++) {
        frame[HEADER + i] = take(guided);
    }
    if (guided->mode & MODE_CAN) {
        receive_transfer(guided, row, frame + HEADER);
        return;
    }
    guided->sequence++;
    length = (uint8_t)(HEADER + row->length);
    for (i = 1; i < length; i++) {
        crc = wire_crc(crc, frame[i]);
    }
    crc = wire_crc(crc, row->crc_extra);
    frame[length++] = (uint8_t)crc;
    frame[length++] = (uint8_t)(crc >> 8);
    if (step != STEP_MESSAGE) {
        length = sign(guided, frame, length, take(guided));
        frame[length - 1] ^= step == STEP_BAD_SIGNED;
    }
    receive(guided, frame, length);
}

static void raw(struct guided *guided)
{
    uint8_t bytes[64], length = take(guided) % 64, i;
    uint16_t identifier;

    for (i = 0; i < length; i++) {
        bytes[i] = take(guided);
    }
    if (guided->mode & MODE_CAN) {
        identifier = (uint16_t)((bytes[0] | bytes[1] << 8) & 0x7FF);
        receive_frame(guided, identifier, bytes + 2, length % 9);
    } else {
        receive(guided, bytes, length);
    }
}

static void sensors(struct guided *guided)
{
    host_io *io = &guided->host.io;
    uint8_t i, flags = take(guided);

    for (i = 0; i < 2; i++) {
        io->eye[i] = (uint16_t)(take(guided) << 2);
        io->floor[i] = (uint16_t)(take(guided) << 2);
        io->arm[i] = flags >> i & 1;
        io->travel_um[i] = (int32_t)((uint32_t)io->travel_um[i] + (uint32_t)take(guided) * 1000U);
    }
    io->start = flags >> 2 & 1;
    io->battery_mv = (uint16_t)(flags * 40U);
    io->ground_um = (int32_t)((uint32_t)io->ground_um + (uint32_t)take(guided) * 1000U);
    if (guided->mode & MODE_MICRO) {
        io->bump = take(guided);
        io->ready = flags & 1;
        io->has_box = io->has_goal = io->fix_new = flags >> 3 & 1;
        io->fix_um[0] = (int8_t)take(guided) * 250000; /* 32 m */
        io->fix_um[1] = (int8_t)take(guided) * 250000;
        io->fix_heading = (uint16_t)(take(guided) << 8);
        io->fix_age = (uint16_t)(take(guided) * 10U);
        for (i = 0; i < NEIGHBOURS; i++) {
            guided->groups[i] = flags >> (4 + i) & 1;
            guided->bearings[i] = (uint16_t)(take(guided) << 8);
            guided->distances[i] = take(guided) * 4000U;
        }
        host_see(&guided->host, NEIGHBOURS, guided->groups, guided->bearings, guided->distances);
    }
}

static void begin(struct guided *guided)
{
    static const uint64_t year_2024 = 30000000000000ULL;
    uint8_t key[KEY_SIZE], i;
    uint16_t at;

    memset(guided->host.io.nvm, 0xFF, sizeof guided->host.io.nvm);
    guided->time = year_2024;
    if (guided->mode & MODE_KEY) {
        for (i = 0; i < KEY_SIZE; i++) {
            key[i] = (uint8_t)(i + 1);
        }
        host_give_key(&guided->host, key);
    }
    if (guided->mode & MODE_SPOILT) {
        for (i = take(guided); i > 0; i--) {
            at = take(guided);
            at = (uint16_t)(at | take(guided) << 8);
            guided->host.io.nvm[at % HAL_NVM_SIZE] = take(guided);
        }
    }
    guided->host.io.can = guided->mode & MODE_CAN;
    guided->host.io.role = guided->mode & MODE_MICRO ? 2 : 0;
    guided->host.io.has_ring = guided->host.io.has_pose = 1;
    guided->host.io.has_encoders = 1;
    guided->host.io.has_ground = 1;
    host_power_on(&guided->host, 0);
    if (guided->mode & MODE_SLOW) {
        host_slow_down(&guided->host, 1, 192, 57);
    }
    if (guided->mode & MODE_BUSY) {
        host_be_busy(&guided->host, 6000);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct guided guided;
    uint8_t step, count;

    memset(&guided, 0, sizeof guided);
    guided.data = data;
    guided.left = size;
    guided.mode = take(&guided);
    begin(&guided);
    while (guided.left > 0) {
        switch (step = take(&guided) % STEPS) {
        case STEP_MESSAGE:
        case STEP_SIGNED:
        case STEP_BAD_SIGNED:
            message(&guided, step);
            break;
        case STEP_RAW:
            raw(&guided);
            break;
        case STEP_TIME:
            for (count = take(&guided); count > 0; count--) {
                tick(&guided);
            }
            break;
        case STEP_SENSORS:
            sensors(&guided);
            break;
        case STEP_POWER:
            host_power_on(&guided.host, guided.micros);
            break;
        default:
            tick(&guided);
            break;
        }
    }
    tick(&guided);
    return 0;
}
