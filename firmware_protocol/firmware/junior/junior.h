/* Junior, the sumo robot: the state of one, beside what any robot has. */
#ifndef JUNIOR_H
#define JUNIOR_H

#include "core/role.h"
#include "junior/tables.h"

ROLE_DECLARE(junior)

#define MEMORY_SLOTS 32U /* default of MEM_SLOTS; on a 1 KiB EEPROM there is room for no more */

/* --- sensing.c ---------------------------------------------------------------------------------------------------- */

struct arm {
    uint32_t raw_since;     /* ms: the switch has read the same since */
    uint32_t pressed_since; /* ms */
    uint8_t raw;
};

struct sensing {
    uint16_t eye[2], floor[2];
    uint16_t flags;        /* SensorFlag */
    uint8_t edges;         /* press edges of this tick: bit 0 left, bit 1 right */
    struct arm arm[2];
    int32_t encoder[2];    /* um, last reading */
    int16_t travel_um[2];  /* remainder of travel */
    int32_t travel_mm[2];
    int32_t ground;        /* um, last reading */
    int32_t ground_moved;  /* um, in this tick */
};

/* --- maneuver.c, reflex.c ----------------------------------------------------------------------------------------- */

enum { MANEUVER_OPTIONS = 31 }; /* every bit of ManeuverOption */

struct maneuver_plan {
    uint16_t period; /* ms */
    uint8_t options; /* ManeuverOption */
    uint8_t count;
    uint8_t actions[MAX_ACTIONS];
};

enum maneuver_phase { PHASE_IDLE, PHASE_ACTING, PHASE_BACKING, PHASE_TURNING };

struct maneuver {
    struct maneuver_plan plan;
    uint8_t phase;
    uint8_t index;           /* action being performed */
    bool reported;           /* asked for by a host, that wants the result */
    bool changing;           /* stimulus differs from the first one */
    bool turn_left;          /* reflex: way to turn */
    uint32_t phase_end;      /* ms: end of the action, or of the part of the reflex */
    uint32_t changing_since; /* ms */
    int32_t pressed_um;      /* travel while pressed, this action */
    uint16_t press[2];       /* ms: present unbroken press, this action */
    bool result_pending;
    uint32_t result_due;     /* ms */
    mavlink_junior_maneuver_result_t result; /* filled as the maneuver goes */
};

/* --- memory.c ----------------------------------------------------------------------------------------------------- */

enum memory_job { JOB_NONE, JOB_WRITE, JOB_ERASE_OLD, JOB_ERASE_ALL };

struct memory {
    uint8_t order[MEMORY_SLOTS + 1]; /* physical slots in use, by previous, then current stimulus */
    uint8_t used;                    /* how many; one more than MEM_SLOTS while one is being replaced */
    uint16_t checksum;
    bool checked;     /* the checksum is that of the present contents */
    uint8_t job;      /* memory_job */
    uint8_t slot;     /* being written or erased */
    uint8_t old;      /* slot to be erased afterwards, or 0xFF */
    bool asked;       /* the command is to be answered: its session is still open */
    uint16_t sequence; /* of the command */
};

/* --- contest.c ---------------------------------------------------------------------------------------------------- */

struct contest {
    uint32_t begins;     /* ms: end of the countdown */
    uint8_t previous;    /* stimulus that the last maneuver answered */
    uint8_t start_input; /* last reading of the start module */
};

struct junior {
    struct robot robot;
    struct sensing sensing;
    struct maneuver maneuver;
    struct memory memory;
    struct contest contest;
    bool guarded; /* the border stops the wheels */
};

#endif
