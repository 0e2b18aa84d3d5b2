/* MAVLink 2 frames without signatures, as the firmware's send.c makes them. */
#ifndef KERNEL_FRAMING_H
#define KERNEL_FRAMING_H

#include "core/wire.h"

enum { FRAME_HEADER = 10, FRAME_CHECKSUM = 2, FRAME_SIGNATURE = 13, FRAME_MARKER = 0xFD, FRAME_SIGNED = 1 };

typedef struct {
    uint32_t number;       /* of the message */
    uint8_t length, extra; /* of its payload, and the seed of its checksum */
} frame_kind;

/* Number of the message in a frame. */
static inline uint32_t frame_number(const uint8_t *frame)
{
    return frame[7] | (uint32_t)frame[8] << 8 | (uint32_t)frame[9] << 16;
}

/* Length of a whole frame, of which the header is there. */
static inline uint32_t frame_length(const uint8_t *frame)
{
    return (uint32_t)(FRAME_HEADER + frame[1] + FRAME_CHECKSUM + (frame[2] & FRAME_SIGNED ? FRAME_SIGNATURE : 0));
}

/* Makes a frame of a payload. Returns its length. */
uint32_t frame_make(uint8_t *frame, frame_kind kind, const void *payload, uint8_t sequence, uint8_t system, uint8_t component);

#endif
