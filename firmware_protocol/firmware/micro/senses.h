/* The hardware that only a micro-robot has; every target of it implements these functions, too (core/hal.h).
 *
 * An angle has 16 bits: 65536 are a turn, counter-clockwise. A bearing is from the nose. hal_travel is asked of every board: a
 * micro-robot has encoders on both wheels.
 */
#ifndef MICRO_SENSES_H
#define MICRO_SENSES_H

#include <stdbool.h>
#include <stdint.h>

#ifndef MICRO_RING
#define MICRO_RING 1 /* 0: no such board senses others, box and goal; what reads them is left out */
#endif

uint32_t hal_track(void *board);                  /* between the wheels, um; 1000..60000 */
uint16_t hal_full_speed(void *board);             /* of a wheel at 1000 permille, mm/s; not 0 */
void hal_force(void *board, uint8_t share);       /* limit of the wheels' force from now on, %; a board may be unable to */
uint8_t hal_bump(void *board, uint16_t gap);      /* contact: what is nearer to the edge than this (mm) where that can be
                                                     measured; a bit for each of 8 sectors, the first one in the highest */

struct hal_fix {
    int32_t x, y; /* um */
    uint16_t heading;
    uint16_t age; /* ms */
};
bool hal_has_pose(void *board);                   /* it finds its position itself; else SWARM_FIX says it */
bool hal_pose(void *board, struct hal_fix *fix);  /* a fix that is new since it was asked last */

#if MICRO_RING
struct hal_ring { /* what is wanted; lengths in mm, 65535: without end */
    uint16_t least, step, limit; /* all robots within `least`; and where there is none of another class, as many steps further
                                    as bring one in, not beyond `limit`. More may be told */
    uint8_t ranges;              /* directions */
    uint16_t farthest;           /* range */
};
struct hal_neighbour {
    uint8_t group; /* its class */
    uint16_t bearing;
    uint32_t distance; /* between the centres, um */
};
bool hal_has_ring(void *board);                   /* asked once, at power-on */
void hal_ring_start(void *board, const struct hal_ring *ring); /* all of the below is to be measured */
bool hal_ring_ready(void *board);                 /* it is: asked in the periods after that, and what is below then at once */
bool hal_neighbour(void *board, uint16_t index, struct hal_neighbour *neighbour); /* false: there are no more */
uint16_t hal_range(void *board, uint8_t index, bool *robot); /* mm; 65535: nothing in range. robot: it is one */
bool hal_box(void *board, uint16_t *bearing, uint16_t *distance); /* to its surface, mm; false: there is none */
bool hal_goal(void *board, uint16_t *bearing);    /* false: there is none */
bool hal_touch(void *board);                      /* it touches the box */
#endif

#endif
