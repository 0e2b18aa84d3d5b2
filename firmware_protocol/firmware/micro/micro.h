/* A micro-robot of a swarm: the state of one, beside what any robot has. */
#ifndef MICRO_H
#define MICRO_H

#include "core/role.h"
#include "micro/senses.h"
#include "micro/tables.h"

ROLE_DECLARE(micro)

/* --- pose.c ------------------------------------------------------------------------------------------------------- */

enum { POSES = 16 };

struct past { /* a pose that was */
    int32_t x, y;
    uint16_t heading;
};

struct pose {
    int32_t x, y;     /* um */
    uint32_t heading; /* 2^32 are a turn */
    int32_t travel[2]; /* um, last readings */
    uint32_t per_um;  /* heading that a um of difference between the wheels is */
    uint32_t moved;   /* ms: a wheel has turned */
    uint32_t fix_at;  /* ms: when the last fix was true */
    bool fixed;       /* there has been one */
    uint8_t newest;
    uint32_t kept;    /* ms: the newest of these is of then */
    struct past past[POSES];
};

/* --- move.c ------------------------------------------------------------------------------------------------------- */

enum move_phase { MOVE_IDLE, MOVE_TURN, MOVE_DRIVE, MOVE_FACE, MOVE_SENSE, MOVE_REPORT, MOVE_PHASES };

struct move {
    uint8_t phase;   /* move_phase */
    uint8_t options; /* SWARM_MOVE_OPTION */
    uint8_t effort;  /* % */
    uint8_t outcome, reason;
    bool facing;     /* there is a heading to turn to in the end */
    bool reported;   /* there is a host that wants to know how it ended */
    uint16_t sequence;
    uint16_t way;    /* over the ground */
    uint16_t nose;   /* heading on that way: the tail's where it goes backward */
    uint16_t face;
    uint16_t speed;  /* mm/s */
    int32_t distance, travelled; /* um */
    int32_t from_x, from_y;      /* um */
    uint32_t begun;    /* ms: the drive */
    uint32_t deadline; /* ms */
};

/* --- ring.c ------------------------------------------------------------------------------------------------------- */

struct ring_setting { /* mm, as SWARM_SENSE or the parameters say */
    uint16_t radius, increment, limit;
    uint8_t sectors, ranges;
};

struct reading {
    uint16_t near[2], seen[2];
    uint16_t radius, radius_before;
    uint8_t count[2], count_before[2];
};

struct ring {
    struct ring_setting setting;
    bool told;       /* by SWARM_SENSE */
    bool busy;       /* being read */
    uint16_t before; /* radius of the last observation that counts */
    struct reading reading;
};

/* --- observation.c ------------------------------------------------------------------------------------------------ */

enum asker { ASKER_HOLDER, ASKER_WATCHER, ASKERS };

struct observations {
    struct {
        uint16_t sequence;
        bool pending;
    } asked[micro_stream_count][ASKERS];
    mavlink_swarm_observation_t ended; /* of the last move */
    uint32_t due;                      /* ms */
    uint16_t interval;                 /* ms */
#if MICRO_RING
    bool ranges_pending;
    mavlink_swarm_ranges_t ranges;
#endif
};

struct micro {
    struct robot robot;
    uint8_t bumps; /* contact in this period, as hal_bump says it */
    struct pose pose;
    struct move move;
    struct ring ring;
    struct observations observations;
};

#endif
