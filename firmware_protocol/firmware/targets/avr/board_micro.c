/* What only a micro-robot has: encoders on both wheels, bumpers ahead on the left and the right. No ring, and no position system
 * of its own. This motor driver can't limit a force.
 */
#include "drivers.h"
#include "board_micro.h"
#include "core/hal.h"
#include "core/robot.h"
#include "micro/senses.h"

BOARD_MICRO_PINS(PIN_FUNCTIONS)

/* Both encoders are on one port, left in the lowest bits: as a change is seen, all four are read at once. */
#define AT(name, port, bit, label, use) AT_##name = bit,
enum { BOARD_MICRO_PINS(AT) MICRO_PIN_END };
#undef AT
typedef char encoders_are_the_lowest_bits[AT_LEFT_A == 0 && AT_LEFT_B == 1 && AT_RIGHT_A == 2 && AT_RIGHT_B == 3 ? 1 : -1];

enum { ENCODERS = 0x0F };
enum { BUMP_LEFT = 0x80 /* sector 1 */, BUMP_RIGHT = 0x01 /* sector 8 */ };

static volatile int32_t counted[2];
static uint8_t before; /* the outputs, as they were seen last */

/* A goes before B: forward. By the outputs before (bits 3, 2) and now (bits 1, 0), each B A; two changes at once are no way. */
static const int8_t steps[16] = {0, 1, -1, 0, -1, 0, 0, 1, 1, 0, 0, -1, 0, -1, 1, 0};

ISR(PCINT1_vect)
{
    uint8_t now = PINC & ENCODERS;

    counted[LEFT] += steps[(before & 3U) << 2 | (now & 3U)];
    counted[RIGHT] += steps[(before & 12U) | now >> 2];
    before = now;
}

void board_start(void)
{
    pin_high_BUMPER_LEFT(); /* pull-ups */
    pin_high_BUMPER_RIGHT();
    before = PINC & ENCODERS;
    PCMSK1 = ENCODERS;
    PCICR = 1U << PCIE1;
}

int32_t hal_travel(void *board, uint8_t side)
{
    int32_t count;

    (void)board;
    cli();
    count = counted[side];
    sei();
    return (int32_t)((uint32_t)count * BOARD_UM_PER_COUNT);
}

uint32_t hal_track(void *board)
{
    (void)board;
    return BOARD_TRACK_UM;
}

uint16_t hal_full_speed(void *board)
{
    (void)board;
    return BOARD_FULL_SPEED;
}

void hal_force(void *board, uint8_t share)
{
    (void)board;
    (void)share;
}

uint8_t hal_bump(void *board, uint16_t gap)
{
    uint8_t bumps = 0;

    (void)board;
    (void)gap; /* a switch is closed by touch */
    if (!pin_read_BUMPER_LEFT()) {
        bumps |= BUMP_LEFT;
    }
    if (!pin_read_BUMPER_RIGHT()) {
        bumps |= BUMP_RIGHT;
    }
    return bumps;
}

bool hal_has_pose(void *board)
{
    (void)board;
    return false;
}

bool hal_pose(void *board, struct hal_fix *fix)
{
    (void)board;
    (void)fix;
    return false;
}
