/* The middle of a star: what the host says on a network is cut into frames, and each goes to those it is for. */
#ifndef KERNEL_SWARM_ROUTE_H
#define KERNEL_SWARM_ROUTE_H

#include <stdint.h>

enum { ROUTE_ALL = 0, ROUTE_NOWHERE = 255 };

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

#endif
