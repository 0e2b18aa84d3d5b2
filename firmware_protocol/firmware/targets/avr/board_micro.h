/* What a micro-robot's board has where Junior's has arms, eyes and floor sensors; all else is as in board.h.
 *
 * Plain C, like that.
 */
#ifndef MICRO_BOARD_H
#define MICRO_BOARD_H

/* X(name, port, bit, label on the Nano, what is wired to it) */
#define BOARD_MICRO_PINS(X) \
    X(BUMPER_LEFT, D, 2, "D2", "left bumper's switch, the other contact to GND") \
    X(BUMPER_RIGHT, D, 3, "D3", "right bumper's switch, the other contact to GND") \
    X(LEFT_A, C, 0, "A0", "left encoder's output A") \
    X(LEFT_B, C, 1, "A1", "left encoder's output B") \
    X(RIGHT_A, C, 2, "A2", "right encoder's output A") \
    X(RIGHT_B, C, 3, "A3", "right encoder's output B")

#define BOARD_TRACK_UM 30000UL   /* between the wheels' middles */
#define BOARD_UM_PER_COUNT 100UL /* way of a wheel from one change of its encoder's outputs to the next */
#define BOARD_FULL_SPEED 400U    /* mm/s, of a wheel at full effort */

#endif
