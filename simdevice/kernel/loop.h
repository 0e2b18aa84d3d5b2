/* The one place that knows them all: whole control periods of robots in their rings, and of their referees. */
#ifndef KERNEL_LOOP_H
#define KERNEL_LOOP_H

#include "devices.h"
#include "referee.h"

enum { KERNEL_SAID = 1, KERNEL_DECIDED = 2, KERNEL_REBOOTED = 4, KERNEL_DUE = 8, KERNEL_NOISE = 16, KERNEL_SECOND = 32 };

typedef struct {
    kernel_world *world;
    kernel_devices *devices; /* device n sits in piece n */
    kernel_referees *referees;
    uint32_t rings;

    /* For each ring. */
    uint64_t *ticks;         /* control periods that it has lived for */
    uint8_t *living;         /* time passes in it */
    uint8_t *plugged;        /* its Junior hears, and is heard */
    uint8_t *hosted;         /* its second Junior has a host of its own: who fills its rx, and reads its tx */
    uint32_t *room;          /* bytes that its line takes in a control period; UINT32_MAX: any number */
    const uint8_t **answer;  /* what its referee answers in the next control period */
    uint32_t *answer_len;
    uint8_t *stop;           /* why there is something to see to, of the above */
    uint32_t *end;           /* where in `said` its words of the last control period end; those of the next begin there */

    uint8_t *said;           /* all words of the last control period, ring by ring: a Junior's, its referee's answers, a report */
} kernel_loop;

/* Something may be meant for a referee: sets those rings' `stop`, and returns 1. */
uint8_t kernel_asked(kernel_loop *loop, const uint8_t *rx, uint32_t rx_len);

/* Lives for at most so many control periods (and 2^24 - 1): sensors, firmware, wheels, physics, referees. rx arrives at every
 * Junior in the first of them. Returns 2^56 times why, 2^32 times how many it has lived for, and how many bytes have been said.
 * Why: what is in any ring's `stop`; 0 where all periods are over. KERNEL_DUE: a referee's report is to be made and to follow
 * what its ring has said. KERNEL_NOISE: noise has been used up, and more is wanted for the next period. KERNEL_SECOND: a second
 * Junior that has a host of its own has something in its tx, which is not among the bytes that have been said. */
uint64_t kernel_run(kernel_loop *loop, const uint8_t *rx, uint32_t rx_len, uint32_t periods);

/* For measuring: periods of the first ring's physics and nothing else. */
void kernel_physics_alone(kernel_loop *loop, uint32_t periods);

#endif
