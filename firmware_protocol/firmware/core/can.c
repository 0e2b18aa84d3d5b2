/* CAN: frames to messages and back, in place of the bytes of frame.c and send.c. Compiled where FIRMWARE_CAN is 1.
 *
 * An identifier is function << 7 | node; the node is the robot's system id, and 0 for all. E-stop, ROBOT_ALIVE and what the
 * role says are single frames. All else is a transfer: byte 0 is its number (3 bits) and the part (5 bits); behind that, over
 * all parts, come message number, length, the payload without its target fields, and a checksum. A missing part discards the
 * whole. There is one host on a bus.
 */
#include "core/core.h"

#if FIRMWARE_CAN

enum {
    HEAD = 3,
    TAIL = 2,
    PART_DATA = 7,
    PART_MASK = 31,
    PART_BITS = 5,
    FUNCTION_SHIFT = 7,
    NODE_MASK = 127,
    TRANSFERS = 8,
    SILENCE_MS = 50,
    HOST_SYSTEM = 255,
};

static const struct can_row *find_row(const struct robot *robot, uint16_t id)
{
    const struct can_row *rows = ROLE_OF(robot, can);
    uint8_t i;

    for (i = 0; i < ROLE_OF(robot, can_count); i++) {
        if (flash_u16(&rows[i].id) == id) {
            return &rows[i];
        }
    }
    return NULL;
}

static uint8_t own_node(const struct robot *robot)
{
    return robot->system < NODE_MASK ? robot->system : NODE_MASK;
}

/* --- out --------------------------------------------------------------------------------------------------------- */

struct outgoing {
    struct robot *robot;
    struct hal_frame frame;
    uint16_t crc;
};

static void put(struct outgoing *out, uint8_t byte)
{
    out->crc = wire_crc(out->crc, byte);
    out->frame.data[out->frame.length++] = byte;
    if (out->frame.length == FRAME_DATA) {
        hal_frame_write(out->robot->board, &out->frame);
        out->frame.data[0]++; /* the next part */
        out->frame.length = 1;
    }
}

void can_send_single(struct robot *robot, uint8_t function, const void *data)
{
    struct hal_frame frame;

    frame.identifier = (uint16_t)((uint16_t)function << FUNCTION_SHIFT | own_node(robot));
    frame.length = FRAME_DATA;
    memcpy(frame.data, data, FRAME_DATA);
    hal_frame_write(robot->board, &frame);
}

bool can_send(struct robot *robot, uint16_t id, uint8_t crc_extra, const void *payload, uint8_t length)
{
    const struct can_row *row = find_row(robot, id);
    const uint8_t *bytes = payload;
    struct outgoing out;
    uint8_t cut_at, cut, single, i;

    single = ROLE_OF(robot, single_out)(robot, id, payload);
    if (single != SINGLE_NOT) {
        return single == SINGLE_SENT;
    }
    if (row == NULL) {
        return true; /* no message of ours: there is nobody who would understand it */
    }
    cut_at = flash_u8(&row->cut_at);
    cut = flash_u8(&row->cut);
    if (hal_frame_room(robot->board) < (HEAD + length - cut + TAIL + PART_DATA - 1) / PART_DATA) {
        return false;
    }
    out.robot = robot;
    out.crc = 0xFFFF;
    out.frame.identifier = (uint16_t)((uint16_t)CAN_FUNCTION_TRANSFER_UP << FUNCTION_SHIFT | own_node(robot));
    out.frame.data[0] = (uint8_t)(robot->can.number_out << PART_BITS);
    out.frame.length = 1;
    robot->can.number_out = (uint8_t)((robot->can.number_out + 1) % TRANSFERS);
    put(&out, (uint8_t)id);
    put(&out, (uint8_t)(id >> 8));
    put(&out, (uint8_t)(length - cut));
    for (i = 0; i < length; i++) {
        if (i < cut_at || i >= cut_at + cut) {
            put(&out, bytes[i]);
        }
    }
    out.crc = wire_crc(out.crc, crc_extra);
    i = (uint8_t)(out.crc >> 8);
    put(&out, (uint8_t)out.crc);
    put(&out, i);
    if (out.frame.length > 1) {
        hal_frame_write(robot->board, &out.frame);
    }
    return true;
}

/* --- in ---------------------------------------------------------------------------------------------------------- */

/* The transfers before this one that did not come. A bus keeps the order: what is not ahead is the last one again. */
static void count_number(struct robot *robot, struct can_transfer *transfer)
{
    uint8_t gap = (uint8_t)(transfer->number - transfer->next) % TRANSFERS;

    if (transfer->known && gap == TRANSFERS - 1) {
        return;
    }
    if (transfer->known) {
        robot->counters.lost += gap;
    }
    transfer->known = true;
    transfer->next = (uint8_t)((transfer->number + 1) % TRANSFERS);
}

/* The first part. False: it begins nothing that this robot understands. */
static bool begin(struct robot *robot, struct can_transfer *transfer, const struct hal_frame *frame)
{
    const struct can_row *row;

    transfer->number = (uint8_t)(frame->data[0] >> PART_BITS);
    transfer->used = 0;
    transfer->size = 0;
    if (frame->length > HEAD) {
        row = find_row(robot, (uint16_t)(frame->data[1] | (uint16_t)frame->data[2] << 8));
        if (row != NULL && flash_u8(&row->inbound)
            && frame->data[3] <= flash_u8(&row->length) - flash_u8(&row->cut)) {
            transfer->size = (uint8_t)(HEAD + frame->data[3] + TAIL);
            return true;
        }
    }
    robot->counters.unknown++;
    if (transfer->known && transfer->number == transfer->next) { /* not checked: believe it when it is the very next one */
        transfer->next = (uint8_t)((transfer->next + 1) % TRANSFERS);
    }
    return false;
}

/* All parts are there: true where it is a good message. */
static bool finish(struct robot *robot, struct can_transfer *transfer, uint8_t node, struct can_message *message)
{
    const uint8_t *data = transfer->data;
    const struct can_row *row = find_row(robot, (uint16_t)(data[0] | (uint16_t)data[1] << 8));
    uint8_t cut_at = flash_u8(&row->cut_at);
    uint8_t cut = flash_u8(&row->cut);
    uint8_t length = data[2];
    uint8_t head = length < cut_at ? length : cut_at;
    uint8_t *payload = message->payload.bytes;
    uint16_t crc = 0xFFFF;
    uint8_t i;

    for (i = 0; i < HEAD + length; i++) {
        crc = wire_crc(crc, data[i]);
    }
    crc = wire_crc(crc, flash_u8(&row->crc_extra));
    if (data[HEAD + length] != (uint8_t)crc || data[HEAD + length + 1] != (uint8_t)(crc >> 8)) {
        robot->counters.bad_checksum++;
        return false;
    }
    count_number(robot, transfer);
    message->id = flash_u16(&row->id);
    memcpy(payload, data + HEAD, head);
    memcpy(payload + cut_at + cut, data + HEAD + head, (size_t)(length - head));
    if (cut > 0) {
        payload[cut_at] = node;
    }
    if (cut > 1) {
        payload[cut_at + 1] = WIRE_OWN_COMPONENT;
    }
    return true;
}

static bool take_part(struct robot *robot, const struct hal_frame *frame, uint8_t node, struct can_message *message)
{
    struct can_transfer *transfer = &robot->can.in[node != 0];
    uint8_t part, count, want;

    if (frame->length == 0 || frame->length > FRAME_DATA) {
        robot->counters.unknown++;
        return false;
    }
    part = frame->data[0] & PART_MASK;
    count = (uint8_t)(frame->length - 1);
    if (transfer->size > 0 && frame->data[0] == transfer->head && count == transfer->count
        && memcmp(transfer->data + transfer->used - count, frame->data + 1, count) == 0) {
        return false; /* a part that comes twice */
    }
    if (part == 0) {
        if (!begin(robot, transfer, frame)) {
            return false;
        }
    } else if (transfer->size == 0 || robot->time.now - transfer->heard > SILENCE_MS
               || frame->data[0] != (uint8_t)(transfer->head + 1)) {
        transfer->size = 0;
        return false;
    }
    want = (uint8_t)(transfer->size - transfer->used);
    if (count != (want < PART_DATA ? want : PART_DATA)) {
        transfer->size = 0;
        robot->counters.unknown++;
        return false;
    }
    memcpy(transfer->data + transfer->used, frame->data + 1, count);
    transfer->used = (uint8_t)(transfer->used + count);
    transfer->head = frame->data[0];
    transfer->count = count;
    transfer->heard = robot->time.now;
    if (transfer->used < transfer->size) {
        return false;
    }
    transfer->size = 0;
    return finish(robot, transfer, node, message);
}

static bool take_stop(struct robot *robot, const struct hal_frame *frame, uint8_t node, struct can_message *message)
{
    mavlink_command_long_t *command = &message->payload.command_long;

    if (frame->length != 1 || frame->data[0] != 1) {
        robot->counters.unknown++;
        return false;
    }
    message->id = MAVLINK_MSG_ID_COMMAND_LONG;
    command->command = MAV_CMD_DO_FLIGHTTERMINATION;
    command->param1 = 1.0f;
    command->target_system = node;
    command->target_component = WIRE_OWN_COMPONENT;
    return true;
}

static bool take_alive(struct robot *robot, const struct hal_frame *frame, uint8_t node, struct can_message *message)
{
    mavlink_robot_alive_t *alive = &message->payload.alive;

    if (frame->length != sizeof alive->host) {
        robot->counters.unknown++;
        return false;
    }
    message->id = MAVLINK_MSG_ID_ROBOT_ALIVE;
    memcpy(&alive->host, frame->data, sizeof alive->host);
    alive->target_system = node;
    alive->target_component = WIRE_OWN_COMPONENT;
    return true;
}

bool can_take(struct robot *robot, const struct hal_frame *frame, struct can_message *message)
{
    uint8_t node = (uint8_t)(frame->identifier & NODE_MASK);

    memset(message, 0, sizeof *message);
    if (node != 0 && node != own_node(robot)) {
        return false;
    }
    message->direct = node != 0;
    switch (frame->identifier >> FUNCTION_SHIFT) {
    case CAN_FUNCTION_ESTOP:
        return take_stop(robot, frame, node, message);
    case CAN_FUNCTION_ALIVE:
        return take_alive(robot, frame, node, message);
    case CAN_FUNCTION_TRANSFER_DOWN:
        return take_part(robot, frame, node, message);
    default: /* the role's, or other people's */
        return ROLE_OF(robot, single_in)(robot, (uint8_t)(frame->identifier >> FUNCTION_SHIFT), frame, node, message);
    }
}

void can_receive(struct robot *robot)
{
    struct hal_frame frame;
    struct can_message message;
    struct sender from;

    from.system = HOST_SYSTEM;
    from.component = MAV_COMP_ID_MISSIONPLANNER;
    while (hal_frame_read(robot->board, &frame)) {
        if (!can_take(robot, &frame, &message)) {
            continue;
        }
        robot->counters.good++;
        keeper_frame(robot, from);
        protocol_handle(robot, from, message.direct, message.id, &message.payload);
    }
}

#else
typedef int can_is_off; /* ISO C wants something here */
#endif
