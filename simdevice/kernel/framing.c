#include "framing.h"

#include <string.h>

uint32_t frame_make(uint8_t *frame, frame_kind kind, const void *payload, uint8_t sequence, uint8_t system, uint8_t component)
{
    uint32_t length = kind.length, i;
    uint16_t crc = 0xFFFF;

    memcpy(frame + FRAME_HEADER, payload, length);
    while (length > 1 && frame[FRAME_HEADER + length - 1] == 0) {
        length--;
    }
    frame[0] = FRAME_MARKER;
    frame[1] = (uint8_t)length;
    frame[2] = frame[3] = 0;
    frame[4] = sequence;
    frame[5] = system;
    frame[6] = component;
    for (i = 0; i < 3; i++) {
        frame[7 + i] = (uint8_t)(kind.number >> (8 * i));
    }
    for (i = 1; i < FRAME_HEADER + length; i++) {
        crc = wire_crc(crc, frame[i]);
    }
    crc = wire_crc(crc, kind.extra);
    frame[FRAME_HEADER + length] = (uint8_t)crc;
    frame[FRAME_HEADER + length + 1] = (uint8_t)(crc >> 8);
    return FRAME_HEADER + length + FRAME_CHECKSUM;
}
