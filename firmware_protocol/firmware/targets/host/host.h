/* The host build: a board made of memory, so that one process runs as many robots as it likes. */
#ifndef JUNIOR_HOST_H
#define JUNIOR_HOST_H

#include <stdint.h>

#include "host_roles.h"

typedef struct {             /* what the board's drivers would read and write; filled before each tick */
    uint16_t eye[2];         /* ADC counts 0..1023, left right */
    uint16_t floor[2];       /* ADC counts */
    uint16_t battery_mv;
    uint8_t arm[2];          /* 1 = switch closed (raw, before debounce) */
    uint8_t has_encoders;    /* 0: firmware integrates its own commands */
    uint8_t has_ground;      /* 1: ground odometer fitted */
    int32_t travel_um[2];    /* wheel encoders since power-on */
    int32_t ground_um;       /* ground odometer, forward positive, since power-on */
    uint8_t start;           /* start module: 1 = go */
    int16_t wheel[2];        /* OUT: commanded effort, permille -1000..1000, left right */
    uint8_t reboot;          /* OUT: the firmware asks for a reset (command 246) */
    uint8_t tx[2048];        /* OUT: bytes to send */
    uint32_t tx_len;
    uint8_t nvm[1024];       /* EEPROM image: the device saves and restores it; 0xFF = blank */
    uint64_t uid;
    uint8_t can;             /* 1 at power-on: CAN. rx and tx then hold frames of 16 bytes, as Linux's struct can_frame */
    uint8_t role;            /* at power-on, as in AUTOPILOT_VERSION.product_id; one that there is not is Junior */

    /* Of a micro-robot. An angle has 16 bits: 65536 are a turn. */
    uint8_t force;           /* OUT: limit of the wheels' force, % */
    uint8_t bump;            /* contact in each of 8 sectors, the first one in the highest bit */
    uint8_t touch;           /* 1 = it touches the box */
    uint8_t has_pose;        /* 0: its fixes come by SWARM_FIX */
    uint8_t has_ring;
    uint8_t fix_new;         /* 1 = there is a new position fix; the firmware sets it to 0 */
    uint16_t fix_heading;
    uint16_t fix_age;        /* ms */
    int32_t fix_um[2];
    uint16_t full_speed;     /* of a wheel at 1000 permille, mm/s; 0: 400 */
    uint32_t track_um;       /* between the wheels; 0: 30000 */
    uint16_t gap;            /* OUT: nearer than this, in mm, is contact */
    uint8_t asked;           /* OUT: 1 = ring, ranges, box and goal are wanted; 0 when the firmware has taken them */
    uint8_t ready;           /* 1 = they are there, in the period after that or a later one */
    uint8_t ranges;          /* OUT: directions that are wanted */
    uint16_t least;          /* OUT, as the next three: what is wanted, in mm; 65535: without end (micro/senses.h) */
    uint16_t step;
    uint16_t limit;
    uint16_t farthest;
    uint16_t range[32];      /* mm; 65535: nothing in range */
    uint32_t range_robots;   /* a bit for each direction in which it is a robot; the first one in the lowest */
    uint8_t has_box;
    uint8_t has_goal;
    uint16_t box_bearing;
    uint16_t box_distance;   /* mm */
    uint16_t goal_bearing;
} host_io;

typedef struct {
    host_io io;
    union host_roles as;
    uint64_t micros;
    const uint8_t *rx;
    uint32_t rx_len;
    int32_t writes_left; /* non-volatile bytes that can be written before the power fails; negative: it does not */
    uint32_t writes;     /* non-volatile bytes written since power-on: wear */
    uint32_t nvm_per_tick, nvm_left;             /* bytes that can be written in a tick; 0: any number */
    uint32_t tx_buffer, tx_per_tick, tx_backlog; /* bytes; 0: no buffer behind io.tx, which is emptied in every tick */
    uint32_t neighbours; /* of a micro-robot's ring, in: */
    const uint8_t *neighbour_group;
    const uint16_t *neighbour_bearing;
    const uint32_t *neighbour_distance;
    uint16_t used;       /* us of each control period that are gone whenever the firmware looks */
} host_robot;

/* Boots: reads io.nvm, counts the boot, comes up disarmed. */
void host_power_on(host_robot *host, uint64_t micros);

/* The same, and non-volatile writes beyond this many bytes are lost, as when the power is cut while it boots. */
void host_power_on_cut(host_robot *host, uint64_t micros, int32_t writes);

/* Cuts the power and gives it back: of io, only nvm and what is set before power-on is kept, and the clock starts at 0. */
void host_restart(host_robot *host);

/* Puts a signing key of 32 bytes into non-volatile memory, as who holds the board can; takes effect at power-on. */
void host_give_key(host_robot *host, const uint8_t *key);

/* One control period (5 ms). Returns io.tx_len; tx is cleared at the start of each tick. */
uint32_t host_tick(host_robot *host, uint64_t micros, const uint8_t *rx, uint32_t rx_len);

/* Whom a micro-robot's ring finds when it is read: class, bearing (65536 are a turn) and distance in um of each. Nothing is
 * copied: the arrays must be there until the tick is over that reads them. */
void host_see(host_robot *host, uint32_t count, const uint8_t *group, const uint16_t *bearing, const uint32_t *um);

/* From now on, non-volatile writes beyond this many bytes are lost, as in a power cut; negative: no cut. */
void host_cut_power(host_robot *host, int32_t writes);

/* From now on, writing is as slow as on a micro-controller: this many non-volatile bytes a tick, a buffer of this many
 * bytes to send through, of which this many leave in a tick. 0: as fast as ever. */
void host_slow_down(host_robot *host, uint32_t nvm_per_tick, uint32_t tx_buffer, uint32_t tx_per_tick);

/* From now on, this much of every control period is gone whenever the firmware looks, as where hashing takes long; in us. */
void host_be_busy(host_robot *host, uint16_t micros);

/* For tests: a message over CAN without anything being done about it. Frames go to io.tx; returns io.tx_len. */
uint32_t host_can_send(host_robot *host, uint16_t message, const uint8_t *payload, uint8_t length);
/* Takes frames as in rx; returns the id of the last message that they complete, or -1. payload has room for 255 bytes. */
int32_t host_can_take(host_robot *host, const uint8_t *rx, uint32_t rx_len, uint8_t *payload);

/* For tests: a micro-robot's sine of an angle, times 32767; and the angle of a vector. */
int16_t host_sine(uint16_t angle);
uint16_t host_angle(int32_t y, int32_t x);

/* What tests look at. */
uint8_t host_state(const host_robot *host);
uint32_t host_nvm_writes(const host_robot *host);

#endif
