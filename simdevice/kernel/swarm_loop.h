/* Micro-robots with their firmware on a table: whole control periods for everybody.
 *
 * A network is a star: what comes in is handed to those it is for (swarm_route.h), what they send goes to the host in the order
 * of their rows. The robots of a network are neighbouring rows. */
#ifndef KERNEL_SWARM_LOOP_H
#define KERNEL_SWARM_LOOP_H

#include "host.h"
#include "swarm_route.h"
#include "table.h"

enum { SWARM_SAID = 1, SWARM_REBOOTED = 2, SWARM_NOISE = 4, SWARM_TOUCHED = 8 };

typedef struct {
    kernel_table *table;
    host_robot *robot;    /* by row */
    uint32_t period_us, networks;
    uint64_t ticks;       /* control periods so far */
    double full_speed;    /* of a wheel at 1000 permille, m/s */
    uint16_t touching;    /* who touches the box, of the first 16 rows */

    /* For each robot. */
    uint64_t *micros;     /* since power-on */
    uint8_t *running;     /* it has power */
    uint8_t *plugged;     /* it hears, and is heard */
    uint8_t *system;      /* id that it has on its network */
    uint16_t *battery;    /* mV */
    uint32_t *rx_at, *rx_length; /* what arrives in the next period, in `arrived` */
    uint32_t *next_of;    /* while frames are handed out: the next one with the same id, and 1 */
    uint8_t *number;      /* of the next frame that it is handed, for each of ROUTE_SENDERS */

    /* For each network. */
    uint32_t *first;      /* its first row; and once more where the last one's end */
    swarm_senders *senders;
    uint32_t *end;        /* where in `said` its words end; those of the next begin there */

    uint8_t *arrived;
    uint32_t arrived_length;
    uint8_t *said;        /* words of the last control period, network by network; room for 2048 bytes of every robot */

    /* While a ring is read; room for all. */
    uint8_t *seen_group;
    uint16_t *seen_bearing;
    uint32_t *seen_um;
} swarm_loop;

/* How many bytes of `arrived` it takes to hand out what has just been cut. */
uint32_t swarm_wanted(swarm_loop *loop, const swarm_route *route, uint32_t network);

/* Hands it out: it arrives in the next control period. swarm_wanted comes first. */
void swarm_deliver(swarm_loop *loop, const swarm_route *route, uint32_t network, const uint8_t *data);

/* Hands bytes to a network's robots as they are: where there is one only, nothing needs to be chosen. */
void swarm_pass(swarm_loop *loop, uint32_t network, const uint8_t *data, uint32_t length);

/* Gives a robot its power: it boots. Takes it away: its wheels are off, and nothing is heard of it. */
void swarm_power_on(swarm_loop *loop, uint32_t row);
void swarm_power_off(swarm_loop *loop, uint32_t row);

/* Lives for at most so many control periods, 1 to 2^24 - 1: sensors, firmware, wheels, physics; until somebody says something.
 * Returns 2^56 times why it came back, 2^32 times how many it has lived for, and how many bytes have been said. Why: SWARM_...;
 * 0 where all periods are over. SWARM_NOISE: more noise is wanted before the next period. SWARM_TOUCHED: `touching` has changed. */
uint64_t swarm_run(swarm_loop *loop, uint32_t periods);

#endif
