#include "swarm_route.h"

#include "core/wire.h"

enum { MARKER = 0xFD, HEADER = 10, CHECKSUM = 2, SIGNATURE = 13, FLAG_SIGNED = 1, FOR_ALL = 255 };
enum { AT_LENGTH = 1, AT_FLAGS = 2, AT_SEQUENCE = 4, AT_SYSTEM = 5, AT_COMPONENT = 6, AT_ID = 7, HALF = 128 };
enum { RECORD = 16, FUNCTION_SHIFT = 7, NODE_MASK = 127, TO_TABLE = 10, LAST_IDENTIFIER = 0x7FF };

static void found(swarm_route *route, uint32_t at, uint32_t length, uint8_t to)
{
    route->frame_at[route->frames] = at;
    route->frame_length[route->frames] = length;
    route->frame_to[route->frames] = to;
    route->frames++;
    route->for_table += to == route->table_system;
}

/* The row of a message; `kinds` where it is not known. */
static uint32_t kind_of(const swarm_route *route, const uint8_t *frame)
{
    uint16_t id = (uint16_t)(frame[AT_ID] | frame[AT_ID + 1] << 8);
    uint32_t kind;

    if (frame[AT_ID + 2] != 0) {
        return route->kinds;
    }
    for (kind = 0; kind < route->kinds && route->kind_id[kind] != id; kind++) {
    }
    return kind;
}

static uint16_t checksum(const uint8_t *frame, uint8_t seed)
{
    uint32_t end = HEADER + frame[AT_LENGTH], at;
    uint16_t crc = 0xFFFF;

    for (at = AT_LENGTH; at < end; at++) {
        crc = wire_crc(crc, frame[at]);
    }
    return wire_crc(crc, seed);
}

static uint8_t is_good(const uint8_t *frame, uint8_t seed)
{
    const uint8_t *end = frame + HEADER + frame[AT_LENGTH];
    uint16_t crc = checksum(frame, seed);

    return end[0] == (uint8_t)crc && end[1] == (uint8_t)(crc >> 8);
}

uint32_t swarm_heard(swarm_senders *senders, const uint8_t *frame)
{
    uint32_t i;
    uint8_t gap;

    for (i = 0; i < ROUTE_SENDERS; i++) {
        if (senders->known[i] && senders->system[i] == frame[AT_SYSTEM] && senders->component[i] == frame[AT_COMPONENT]) {
            break;
        }
    }
    if (i == ROUTE_SENDERS) {
        i = senders->newest = (uint8_t)((senders->newest + 1) % ROUTE_SENDERS);
        senders->known[i] = 1;
        senders->system[i] = frame[AT_SYSTEM];
        senders->component[i] = frame[AT_COMPONENT];
        senders->next[i] = frame[AT_SEQUENCE];
        senders->lost[i] = 0;
    }
    gap = (uint8_t)(frame[AT_SEQUENCE] - senders->next[i]);
    if (gap < HALF) { /* else it comes twice, or late */
        senders->lost[i] = (uint8_t)(senders->lost[i] + gap < HALF ? senders->lost[i] + gap : HALF - 1);
        senders->next[i] = (uint8_t)(frame[AT_SEQUENCE] + 1);
    }
    return i;
}

void swarm_renumber(const swarm_route *route, uint8_t *frame, uint8_t number)
{
    uint8_t *end = frame + HEADER + frame[AT_LENGTH];
    uint16_t crc;

    if (frame[AT_FLAGS] & FLAG_SIGNED) {
        return;
    }
    frame[AT_SEQUENCE] = number;
    crc = checksum(frame, route->kind_seed[kind_of(route, frame)]);
    end[0] = (uint8_t)crc;
    end[1] = (uint8_t)(crc >> 8);
}

static uint32_t cut_mavlink(swarm_route *route, const uint8_t *data, uint32_t length)
{
    uint32_t at = 0;

    while (at < length) {
        const uint8_t *frame = data + at;
        uint32_t whole, kind;
        uint8_t system_at;

        if (frame[0] != MARKER) {
            route->bad++;
            at++;
            continue;
        }
        if (length - at < HEADER) {
            return at;
        }
        kind = kind_of(route, frame);
        whole = (uint32_t)HEADER + frame[AT_LENGTH] + CHECKSUM + (frame[AT_FLAGS] & FLAG_SIGNED ? SIGNATURE : 0);
        if (kind == route->kinds || (frame[AT_FLAGS] & ~FLAG_SIGNED) != 0) {
            route->bad++;
            at++;
            continue;
        }
        if (length - at < whole) {
            return at;
        }
        if (!is_good(frame, route->kind_seed[kind])) {
            route->bad++;
            at++;
            continue;
        }
        system_at = route->kind_system_at[kind];
        if (system_at == FOR_ALL || system_at >= frame[AT_LENGTH]) { /* zeros at the end of a payload are left out */
            found(route, at, whole, ROUTE_ALL);
        } else {
            found(route, at, whole, frame[HEADER + system_at]);
        }
        at += whole;
    }
    return at;
}

static uint32_t cut_can(swarm_route *route, const uint8_t *data, uint32_t length)
{
    uint32_t at = 0;

    for (; length - at >= RECORD; at += RECORD) {
        const uint8_t *frame = data + at;
        uint32_t identifier = frame[0] | (uint32_t)frame[1] << 8 | (uint32_t)frame[2] << 16 | (uint32_t)frame[3] << 24;
        uint8_t node = (uint8_t)(identifier & NODE_MASK);

        if (identifier > LAST_IDENTIFIER) {
            route->bad += RECORD;
        } else if (identifier >> FUNCTION_SHIFT == TO_TABLE) {
            found(route, at, RECORD, route->table_system);
        } else {
            found(route, at, RECORD, node);
        }
    }
    return at;
}

uint32_t swarm_cut(swarm_route *route, const uint8_t *data, uint32_t length)
{
    route->frames = 0;
    route->for_table = 0;
    return route->can ? cut_can(route, data, length) : cut_mavlink(route, data, length);
}
