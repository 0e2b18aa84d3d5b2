/* MAVLink 2 framing: bytes in, good frames out.
 *
 * A header is rejected as soon as it can't be one of ours: impossible length, unknown flags, unknown id. Only its first
 * byte is dropped; what follows is looked at again, so that a damaged frame never takes a good one with it. A partial
 * frame is given up after 20 ms of silence, again byte by byte. Signed frames are taken without looking at the signature,
 * unless signing is compiled in and there is a key: then a frame must be believed, or be an emergency stop.
 */
#include "core/core.h"

enum {
    STX = 0xFD,
    HEADER = 10,
    CHECKSUM = 2,
    SIGNATURE = 13,
    FLAG_SIGNED = 1,
    SILENCE_MS = 20,
    AT_LENGTH = 1,
    AT_FLAGS = 2,
    AT_SEQUENCE = 4,
    AT_SYSTEM = 5,
    AT_COMPONENT = 6,
    AT_ID = 7,
    NO_FIELD = 255,
};

INBOUND_TABLE(INBOUND_FITS)
#if FIRMWARE_SIGNING
SIGNING_TABLE(INBOUND_FITS)
#endif

static const struct inbound_row *find_row(const struct robot *robot, const uint8_t *bytes)
{
    const struct inbound_row *rows = ROLE_OF(robot, inbound);
    uint16_t id = (uint16_t)(bytes[AT_ID] | (uint16_t)bytes[AT_ID + 1] << 8);
    uint8_t i;

    if (bytes[AT_ID + 2] != 0) {
        return NULL;
    }
    for (i = 0; i < ROLE_OF(robot, inbound_count) + FIRMWARE_SIGNING; i++) {
        if (flash_u16(&rows[i].id) == id) {
            return &rows[i];
        }
    }
    return NULL;
}

/* Counts the frames that are missing before this one. Gaps of half the range or more are repetitions. */
static void count_sequence(struct robot *robot, struct sender from, uint8_t sequence, bool verified)
{
    struct frame *frame = &robot->frame;
    uint8_t i, gap;

    for (i = 0; i < SENDERS; i++) {
        if (frame->senders[i].known && frame->senders[i].sender.system == from.system
            && frame->senders[i].sender.component == from.component) {
            break;
        }
    }
    if (!verified) { /* an id that is not ours: believe the header when it is the very next one */
        if (i < SENDERS && frame->senders[i].next == sequence) {
            frame->senders[i].next++;
        }
        return;
    }
    if (i == SENDERS) {
        frame->newest = (uint8_t)((frame->newest + 1) % SENDERS);
        i = frame->newest;
        frame->senders[i].known = true;
        frame->senders[i].sender = from;
        frame->senders[i].next = sequence;
    }
    gap = (uint8_t)(sequence - frame->senders[i].next);
    if (gap < 128) {
        robot->counters.lost += gap;
        frame->senders[i].next = (uint8_t)(sequence + 1);
    }
}

static void drop(struct frame *frame, uint8_t count)
{
    frame->used = (uint8_t)(frame->used - count);
    memmove(frame->bytes, frame->bytes + count, frame->used);
}

/* Drops the first byte and what follows it up to the next start marker. */
static void resync(struct frame *frame)
{
    uint8_t skip = 1;

    while (skip < frame->used && frame->bytes[skip] != STX) {
        skip++;
    }
    drop(frame, skip);
}

static bool checksum_good(const uint8_t *bytes, uint8_t length, uint8_t crc_extra)
{
    uint16_t crc = 0xFFFF;
    uint8_t i;

    for (i = 1; i < HEADER + length; i++) {
        crc = wire_crc(crc, bytes[i]);
    }
    crc = wire_crc(crc, crc_extra);
    return bytes[HEADER + length] == (uint8_t)crc && bytes[HEADER + length + 1] == (uint8_t)(crc >> 8);
}

/* Stopping needs no proof: who can speak here could as well jam the line, and the watchdog would stop the robot. */
static bool is_stop(const struct inbound_row *row, const union inbound *message)
{
    return flash_u16(&row->id) == MAVLINK_MSG_ID_COMMAND_LONG
           && message->command_long.command == MAV_CMD_DO_FLIGHTTERMINATION;
}

static void deliver(struct robot *robot, const struct inbound_row *row, bool believed)
{
    const uint8_t *bytes = robot->frame.bytes;
    uint8_t system_at = flash_u8(&row->system_at);
    uint8_t component_at = flash_u8(&row->component_at);
    struct sender from;
    union inbound message;
    bool direct = true; /* to this robot, not to all */

    from.system = bytes[AT_SYSTEM];
    from.component = bytes[AT_COMPONENT];
    if (believed) {
        robot->counters.good++;
        count_sequence(robot, from, bytes[AT_SEQUENCE], true);
    }
    if (from.system == robot->system && from.component == WIRE_OWN_COMPONENT) {
        return; /* an echo of our own */
    }
    if (believed) {
        keeper_frame(robot, from);
    }
    memset(&message, 0, sizeof message);
    memcpy(message.bytes, bytes + HEADER, bytes[AT_LENGTH]);
    if (system_at != NO_FIELD) {
        direct = message.bytes[system_at] != 0;
        if (direct && message.bytes[system_at] != robot->system) {
            return;
        }
    }
    if (component_at != NO_FIELD && message.bytes[component_at] != 0
        && message.bytes[component_at] != WIRE_OWN_COMPONENT) {
        return;
    }
    if (!believed && !is_stop(row, &message)) {
        return;
    }
    protocol_handle(robot, from, direct, flash_u16(&row->id), &message);
}

/* Takes every frame that is complete; leaves a part of one, or nothing. */
static void advance(struct robot *robot)
{
    struct frame *frame = &robot->frame;
    uint8_t *bytes = frame->bytes;

    while (frame->used > 0) {
        const struct inbound_row *row;
        uint8_t total;

        if (bytes[0] != STX) {
            resync(frame);
            continue;
        }
        frame->need = AT_FLAGS + 1;
        if (frame->used < frame->need) {
            return;
        }
        if (bytes[AT_LENGTH] == 0 || bytes[AT_LENGTH] > WIRE_LARGEST_INBOUND || (bytes[AT_FLAGS] & ~FLAG_SIGNED) != 0) {
            robot->counters.unknown++;
            resync(frame);
            continue;
        }
        frame->need = HEADER;
        if (frame->used < frame->need) {
            return;
        }
        row = find_row(robot, bytes);
        if (row == NULL || bytes[AT_LENGTH] > flash_u8(&row->length)) {
            struct sender from;
            from.system = bytes[AT_SYSTEM];
            from.component = bytes[AT_COMPONENT];
            count_sequence(robot, from, bytes[AT_SEQUENCE], false);
            robot->counters.unknown++;
            resync(frame);
            continue;
        }
        total = (uint8_t)(HEADER + bytes[AT_LENGTH] + CHECKSUM + (bytes[AT_FLAGS] & FLAG_SIGNED ? SIGNATURE : 0));
        frame->need = total;
        if (frame->used < frame->need) {
            return;
        }
        if (!checksum_good(bytes, bytes[AT_LENGTH], flash_u8(&row->crc_extra))) {
            robot->counters.bad_checksum++;
            resync(frame);
            continue;
        }
#if FIRMWARE_SIGNING
        if (robot->signing.on) {
            uint8_t verdict = signing_judge(robot, bytes, total);

            deliver(robot, row, verdict == SIGNING_BELIEVED);
            if (verdict == SIGNING_WRONG) { /* bytes may be missing: it may end in the middle of the next frame */
                resync(frame);
            } else {
                drop(frame, total);
            }
            continue;
        }
#endif
        deliver(robot, row, true);
        drop(frame, total);
    }
    frame->need = AT_FLAGS + 1;
}

void frame_receive(struct robot *robot)
{
    struct frame *frame = &robot->frame;
    int16_t byte;

#if FIRMWARE_CAN
    if (robot->can.fitted) {
        can_receive(robot);
        return;
    }
#endif
    if (frame->used > 0 && robot->time.now - frame->heard >= SILENCE_MS) {
        while (frame->used > 0) {
            resync(frame);
            advance(robot);
        }
    }
    while ((byte = hal_read(robot->board)) >= 0) {
        frame->heard = robot->time.now;
        if (frame->used == 0 && byte != STX) {
            continue;
        }
        frame->bytes[frame->used++] = (uint8_t)byte;
        if (frame->used >= frame->need) {
            advance(robot);
#if FIRMWARE_SIGNING
            if (frame->used == 0 && signing_late(robot)) {
                return; /* the rest waits: everything else goes on meanwhile */
            }
#endif
        }
    }
}
