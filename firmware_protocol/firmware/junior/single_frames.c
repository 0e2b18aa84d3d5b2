/* Junior's single frames on CAN: JUNIOR_WHEELS comes as one, JUNIOR_SENSORS leaves as three. */
#include "junior/modules.h"

#if FIRMWARE_CAN

const struct can_row junior_can[] HAL_FLASH = {CAN_TABLE(CAN_ROW) JUNIOR_CAN_TABLE(CAN_ROW)};

uint8_t junior_single_out(struct robot *robot, uint16_t id, const void *payload)
{
    const mavlink_junior_sensors_t *sensors = payload;
    uint8_t data[FRAME_DATA];
    uint32_t time;

    if (id != MAVLINK_MSG_ID_JUNIOR_SENSORS) {
        return SINGLE_NOT;
    }
    if (hal_frame_room(robot->board) < 3) {
        return SINGLE_NO_ROOM;
    }
    time = (uint32_t)(sensors->time / 1000U);
    memcpy(data, &time, sizeof time);
    memcpy(data + 4, &sensors->flags, sizeof sensors->flags);
    memcpy(data + 6, &sensors->battery, sizeof sensors->battery);
    can_send_single(robot, CAN_FUNCTION_SWITCHES, data);
    memcpy(data, sensors->eye, sizeof sensors->eye);
    memcpy(data + 4, sensors->floor, sizeof sensors->floor);
    can_send_single(robot, CAN_FUNCTION_EYES, data);
    memcpy(data, sensors->travel, sizeof sensors->travel);
    can_send_single(robot, CAN_FUNCTION_TRAVEL, data);
    return SINGLE_SENT;
}

bool junior_single_in(struct robot *robot, uint8_t function, const struct hal_frame *frame, uint8_t node,
                      struct can_message *message)
{
    mavlink_junior_wheels_t *wheels = &((union junior_inbound *)&message->payload)->wheels;

    if (function != CAN_FUNCTION_WHEELS) {
        return false;
    }
    if (frame->length != FRAME_DATA) {
        robot->counters.unknown++;
        return false;
    }
    message->id = MAVLINK_MSG_ID_JUNIOR_WHEELS;
    memcpy(message->payload.bytes + sizeof wheels->session, frame->data, FRAME_DATA);
    wheels->session = robot->session.id;
    wheels->target_system = node;
    wheels->target_component = WIRE_OWN_COMPONENT;
    return true;
}

#else
typedef int junior_has_no_can; /* ISO C wants something here */
#endif
