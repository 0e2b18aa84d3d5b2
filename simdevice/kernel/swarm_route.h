/* The middle of a star: what the host says on a network is cut into frames, and each goes to those it is for.
 *
 * A sender numbers its frames, and a robot takes a gap for lost ones. On the way to each robot frames are therefore numbered
 * anew: a frame that has gone to others leaves no gap there, and one that never came leaves its gap with a robot that is spoken
 * to alone next. What is signed stays as it is. */
#ifndef KERNEL_SWARM_ROUTE_H
#define KERNEL_SWARM_ROUTE_H

#include <stdint.h>

enum { ROUTE_ALL = 0, ROUTE_SENDERS = 4 };

typedef struct {
    uint8_t can;           /* frames of 16 bytes, as Linux's struct can_frame; else MAVLink 2 */
    uint8_t table_system;  /* who is no robot */

    /* Messages of MAVLink that are known: what their checksum begins with, and where the payload says for whom they are. */
    uint32_t kinds;
    uint16_t *kind_id;
    uint8_t *kind_seed, *kind_system_at; /* 255: they are for all */

    /* What the last cutting has found. Room for as many frames as there may be: one for each 12 bytes, or 16 on CAN. */
    uint32_t frames;
    uint32_t *frame_at, *frame_length;
    uint8_t *frame_to;     /* system id; ROUTE_ALL */
    uint32_t for_table;    /* how many of them are for table_system, or for all */
    uint32_t bad;          /* bytes since power-on that are in no good frame */
} swarm_route;

/* Cuts bytes into frames. Only those that are whole and good are handed on, as by a switch. Returns how many bytes are done with:
 * what follows may be the beginning of a frame. */
uint32_t swarm_cut(swarm_route *route, const uint8_t *data, uint32_t length);

typedef struct { /* who has sent frames on a network, and which is next */
    uint8_t known[4], system[4], component[4], next[4], lost[4]; /* ROUTE_SENDERS of them */
    uint8_t newest;
} swarm_senders;

/* A frame of MAVLink has come on a network. Returns which of the senders it is from. */
uint32_t swarm_heard(swarm_senders *senders, const uint8_t *frame);

/* Gives a frame another number. */
void swarm_renumber(const swarm_route *route, uint8_t *frame, uint8_t number);

#endif
