/* Messages to MAVLink 2 frames: header, payload without its trailing zeros, checksum, signature, straight to the hardware. */
#include "core/core.h"

enum { HEADER = 10, CHECKSUM = 2, SIGNATURE = 13, FLAG_SIGNED = 1 };

bool send_frame(struct robot *robot, uint16_t id, uint8_t crc_extra, const void *payload, uint8_t length)
{
    const uint8_t *bytes = payload;
    uint8_t header[HEADER], tail[CHECKSUM + (FIRMWARE_SIGNING ? SIGNATURE : 0)];
    uint8_t tail_length = CHECKSUM;
    uint16_t crc = 0xFFFF;
    uint8_t i;

#if FIRMWARE_CAN
    if (robot->can.fitted) {
        return can_send(robot, id, crc_extra, payload, length);
    }
#endif
    while (length > 1 && bytes[length - 1] == 0) {
        length--;
    }
#if FIRMWARE_SIGNING
    if (robot->signing.on) {
        tail_length = CHECKSUM + SIGNATURE;
    }
#endif
    if (hal_write_room(robot->board) < (uint16_t)(HEADER + length + tail_length)) {
        return false;
    }
    header[0] = 0xFD;
    header[1] = length;
    header[2] = tail_length > CHECKSUM ? FLAG_SIGNED : 0;
    header[3] = 0;
    header[4] = robot->frame.sequence_out++;
    header[5] = robot->system;
    header[6] = WIRE_OWN_COMPONENT;
    header[7] = (uint8_t)id;
    header[8] = (uint8_t)(id >> 8);
    header[9] = 0;
    for (i = 1; i < HEADER; i++) {
        crc = wire_crc(crc, header[i]);
    }
    for (i = 0; i < length; i++) {
        crc = wire_crc(crc, bytes[i]);
    }
    crc = wire_crc(crc, crc_extra);
    tail[0] = (uint8_t)crc;
    tail[1] = (uint8_t)(crc >> 8);
#if FIRMWARE_SIGNING
    if (robot->signing.on) {
        signing_sign(robot, header, bytes, length, tail, tail + CHECKSUM);
    }
#endif
    hal_write(robot->board, header, HEADER);
    hal_write(robot->board, bytes, length);
    hal_write(robot->board, tail, tail_length);
    return true;
}
