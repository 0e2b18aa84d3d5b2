/* Angles, their sines, and the angles of vectors, in integers; both errors are less than 0.0002. */
#include "micro/modules.h"

enum { QUARTER = 16384, SINES = 64, ARCS = 32 };

static const int16_t sines[SINES + 1] HAL_FLASH = {
    0, 804, 1608, 2410, 3212, 4011, 4808, 5602, 6393, 7179, 7962, 8739, 9512,
    10278, 11039, 11793, 12539, 13279, 14010, 14732, 15446, 16151, 16846, 17530, 18204, 18868,
    19519, 20159, 20787, 21403, 22005, 22594, 23170, 23731, 24279, 24811, 25329, 25832, 26319,
    26790, 27245, 27683, 28105, 28510, 28898, 29268, 29621, 29956, 30273, 30571, 30852, 31113,
    31356, 31580, 31785, 31971, 32137, 32285, 32412, 32521, 32609, 32678, 32728, 32757, 32767,
};

/* Angles whose tangents are 0, 1/32 .. 1. */
static const uint16_t arcs[ARCS + 1] HAL_FLASH = {
    0, 326, 651, 975, 1297, 1617, 1933, 2246, 2555, 2860, 3159, 3453, 3742,
    4025, 4302, 4572, 4836, 5094, 5344, 5589, 5826, 6058, 6282, 6500, 6712, 6917,
    7117, 7310, 7498, 7679, 7856, 8026, 8192,
};

/* The table between two of its places, of which there is one every `apart`, a power of two. */
static uint16_t between(const uint16_t *table, uint16_t at, uint16_t apart)
{
    uint16_t low = flash_u16(&table[at / apart]);
    uint16_t high = flash_u16(&table[at / apart + (at % apart != 0)]);

    return (uint16_t)(low + ((uint32_t)(uint16_t)(high - low) * (at % apart) + apart / 2U) / apart);
}

int16_t angles_sine(uint16_t angle)
{
    uint16_t in_half = angle % (2U * QUARTER);
    uint16_t sine;

    if (in_half > QUARTER) {
        in_half = (uint16_t)(2U * QUARTER - in_half);
    }
    sine = between((const uint16_t *)sines, in_half, QUARTER / SINES);
    return angle < 2U * QUARTER ? (int16_t)sine : (int16_t)-(int16_t)sine;
}

int16_t angles_cosine(uint16_t angle)
{
    return angles_sine((uint16_t)(angle + QUARTER));
}

uint16_t angles_of(int32_t y, int32_t x)
{
    uint32_t up = (uint32_t)(y < 0 ? -y : y), across = (uint32_t)(x < 0 ? -x : x), more = up > across ? up : across;
    uint32_t less = up > across ? across : up;
    uint16_t angle;

    while (more > UINT16_MAX) {
        more >>= 1;
        less >>= 1;
    }
    if (more == 0) {
        return 0;
    }
    angle = between(arcs, (uint16_t)((less << 15) / more), 32768U / ARCS);
    if (up > across) {
        angle = (uint16_t)(QUARTER - angle);
    }
    if (x < 0) {
        angle = (uint16_t)(2U * QUARTER - angle);
    }
    return y < 0 ? (uint16_t)(0U - angle) : angle;
}

/* In two parts, so that 32 bits suffice. */
int32_t angles_scale(int32_t value, int16_t factor)
{
    return (value >> 15) * factor + (((value & 32767) * factor) >> 15);
}

int16_t angles_to_wire(uint16_t angle) /* 62832 / 65536 */
{
    return (int16_t)(((int32_t)(int16_t)angle * 62832L + 32768L) >> 16);
}

uint16_t angles_from_wire(int16_t angle) /* 34178 / 32768 */
{
    return (uint16_t)(((int32_t)angle * 34178L + 16384L) >> 15);
}

uint16_t angles_from_milli(uint16_t angle)
{
    return (uint16_t)((uint32_t)angle * 10430UL / 1000U);
}
