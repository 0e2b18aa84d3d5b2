/* The one place that knows both: whole control periods of micro-robots that run the firmware, and of the table they stand on. */
#ifndef KERNEL_SWARM_LOOP_H
#define KERNEL_SWARM_LOOP_H

#include "host.h"
#include "table.h"

enum { SWARM_SAID = 1, SWARM_REBOOTED = 2, SWARM_NOISE = 4, SWARM_FULL = 8 };

typedef struct {
    kernel_table *table;
    uint32_t period_us;
    double full_speed;     /* of a wheel at full command, m/s */

    /* For each robot, by the table's rows. */
    host_robot **robot;    /* a micro-robot; has_pose and has_ring of its io are set before its power comes on */
    uint64_t *micros;      /* since power-on */
    uint8_t *running;      /* it is switched on */
    uint8_t *rebooted;     /* it has reset itself, and booted again: 1, until somebody sets it to 0 */
    double *voltage;       /* of its battery, V */
    const uint8_t **rx;    /* what arrives in the next period, and is for it */
    uint32_t *rx_len;

    /* What they say: piece n is `said_len[n]` bytes from `said_at[n]` on, which `said_row[n]` has said in the period of the run
     * that `said_period[n]` names, from 0; by period, then by row. */
    uint8_t *said;
    uint32_t said_size, said_used;
    uint32_t *said_at, *said_len, *said_row, *said_period;
    uint32_t pieces, most_pieces;

    /* What a ring has found: room for all robots. */
    uint8_t *near_group;
    uint16_t *near_bearing;
    uint32_t *near_um;

    uint8_t stop;          /* why the last run has ended before its time: bits of the above; 0: it has not */
} kernel_swarm;

/* Lives for at most so many control periods, from an empty `said`. Ends after the first in which something happens that `heed`
 * names (SWARM_SAID, SWARM_REBOOTED), where noise runs short (SWARM_NOISE), and where what all may say in a period would have no
 * room any more (SWARM_FULL). Returns how many it were. */
uint32_t swarm_run(kernel_swarm *swarm, uint32_t periods, uint8_t heed);

#endif
