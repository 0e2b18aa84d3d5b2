/* The one place that knows both: whole control periods of robots in their rings. */
#ifndef KERNEL_LOOP_H
#define KERNEL_LOOP_H

#include "devices.h"
#include "world.h"

enum { KERNEL_SENT = 1, KERNEL_DECIDED = 2, KERNEL_REBOOTED = 4 };

typedef struct {
    kernel_world *world;
    kernel_devices *devices; /* device n sits in piece n */
    uint32_t rings;
    uint8_t *living;         /* for each ring: time passes in it */
    uint8_t *stop;           /* for each ring: why there is something to see to, of the above */
} kernel_loop;

/* Lives for at most so many control periods: sensors, firmware, wheels, physics. Returns how many it has lived for; fewer
 * where a ring's `stop` says why: what its Junior has sent in the last period is in its tx, its bout has been decided, it has
 * booted again. Fewer without any of that: noise has been used up, and more is wanted for the next period. */
uint32_t kernel_run(kernel_loop *loop, uint32_t periods);

/* For measuring: periods of the first ring's physics and nothing else. */
void kernel_physics_alone(kernel_loop *loop, uint32_t periods);

#endif
