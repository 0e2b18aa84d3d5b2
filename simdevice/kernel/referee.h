/* The referees of rings: when they have something to say and, over MAVLink without signatures, what. They know rings and the
 * wire, and no robot. What they are asked is answered elsewhere. */
#ifndef KERNEL_REFEREE_H
#define KERNEL_REFEREE_H

#include "world.h"

typedef struct {
    uint8_t can;            /* they speak CAN */
    uint8_t speaks;         /* what they say is made here; 0: whoever runs the loop is told that it is due */
    uint8_t component;
    uint32_t longest;       /* room that a report needs, in bytes */
    uint32_t first, beyond; /* identifiers under which they are spoken to on a CAN bus */

    /* For each ring. */
    uint8_t *there;         /* it has one */
    uint8_t *whole;         /* what came last ended with a whole frame that it took */
    uint8_t *system, *sequence, *opponent;
    uint32_t *bout, *every; /* number of the bout; control periods between two reports */
    int32_t *countdown;     /* control periods until the next one */
    uint32_t *reported;     /* bout and outcome that were told last */
    uint8_t *decided;
} kernel_referees;

/* There may be something for a ring's referee in this: it has to look. */
uint8_t referees_asked(const kernel_referees *referees, uint32_t ring, const uint8_t *rx, uint32_t length);

/* A control period is over. Returns 1 where there is something to report. */
uint8_t referees_watch(kernel_referees *referees, const kernel_world *world, uint32_t ring);

/* Makes a report, at this time in s, of at most `longest` bytes. Returns its length; 0 where the wire can't carry it. */
uint32_t referees_report(kernel_referees *referees, const kernel_world *world, uint32_t ring, double now, uint8_t *frame);

#endif
