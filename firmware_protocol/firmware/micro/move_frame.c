/* A micro-robot's single frame on CAN: most moves come as one. */
#include "micro/modules.h"

#if FIRMWARE_CAN

const struct can_row micro_can[] HAL_FLASH = {CAN_TABLE(CAN_ROW) MICRO_CAN_TABLE(CAN_ROW)};

uint8_t micro_single_out(struct robot *robot, uint16_t id, const void *payload)
{
    (void)robot;
    (void)id;
    (void)payload;
    return SINGLE_NOT;
}

bool micro_single_in(struct robot *robot, uint8_t function, const struct hal_frame *frame, uint8_t node,
                     struct can_message *message)
{
    mavlink_swarm_move_t *move = &((union micro_inbound *)&message->payload)->move;

    if (function != CAN_FUNCTION_MOVE) {
        return false;
    }
    if (frame->length != FRAME_DATA) {
        robot->counters.unknown++;
        return false;
    }
    message->id = MAVLINK_MSG_ID_SWARM_MOVE;
    memcpy(message->payload.bytes + sizeof move->session, frame->data, 6); /* sequence, heading, distance */
    move->session = robot->session.id;
    move->face = ANGLE_NONE;
    move->sector = frame->data[6];
    move->sectors = ring_setting(micro_of(robot))->sectors;
    move->options = frame->data[7];
    move->target_system = node;
    move->target_component = WIRE_OWN_COMPONENT;
    return true;
}

#else
typedef int micro_has_no_can; /* ISO C wants something here */
#endif
