/* What only Junior has: arms on two switches, eyes and floor sensors on the converter. No encoders and no ground odometer. */
#include "drivers.h"
#include "core/hal.h"
#include "core/robot.h"
#include "junior/senses.h"

void board_start(void)
{
    pin_high_ARM_LEFT(); /* pull-ups */
    pin_high_ARM_RIGHT();
    DIDR0 = 0x0F; /* A0..A3 are analog */
}

uint8_t hal_arm(void *board, uint8_t side)
{
    (void)board;
    return !(side == LEFT ? pin_read_ARM_LEFT() : pin_read_ARM_RIGHT());
}

bool hal_has_encoders(void *board)
{
    (void)board;
    return false;
}

bool hal_has_ground(void *board)
{
    (void)board;
    return false;
}

int32_t hal_travel(void *board, uint8_t side)
{
    (void)board;
    (void)side;
    return 0;
}

int32_t hal_ground(void *board)
{
    (void)board;
    return 0;
}
