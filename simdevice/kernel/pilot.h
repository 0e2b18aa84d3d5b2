/* Drives Juniors over the wire, as their host would and without one: each step, JUNIOR_WHEELS goes to every ring in which time
 * passes, and what its Junior has said is looked through for JUNIOR_SENSORS. The firmware gets frames and sends frames; nothing
 * of it is reached past. A line may be late by some control periods, the same each way. */
#ifndef KERNEL_PILOT_H
#define KERNEL_PILOT_H

#include "loop.h"

enum { PILOT_NUMBERS = 18, PILOT_WAITING = 32, PILOT_SENSES = 28, PILOT_FRAME = 160, PILOT_FLAGS = 10 };
enum { PILOT_REFUSED = 0xFFFFFF };

typedef struct { /* on its way to a robot */
    uint64_t due;    /* control period that it arrives in, or the first after it, in the ring's own count */
    int16_t speed[2];
    uint8_t greeting; /* the session is opened, and the robot armed, before it */
} pilot_order;

typedef struct { /* on its way from a robot */
    uint64_t due;
    uint8_t senses[PILOT_SENSES]; /* JUNIOR_SENSORS, as its structure has it */
} pilot_word;

typedef struct { /* to one Junior */
    pilot_order down[PILOT_WAITING];
    pilot_word up[PILOT_WAITING];
    uint32_t down_first, down_count, up_first, up_count;
    uint16_t sequence;      /* of the next JUNIOR_WHEELS in the session */
    uint8_t frame_sequence; /* of the next frame */
    uint8_t lost;           /* the robot has booted since it was greeted */
    uint8_t open;           /* the bout's first reading has been taken */
    uint8_t frame[PILOT_FRAME];
    uint8_t heard;          /* a reading has come in the last control period */
    uint64_t time, began;   /* us: of the last reading, and of the bout's first */
    int32_t travel[2];      /* mm, of the last reading */
} pilot_line;

typedef struct {
    kernel_loop *loop;
    pilot_line *line;        /* one of each ring */
    uint32_t delay;          /* control periods that a frame takes, fewer than PILOT_WAITING steps */
    uint16_t session, duration; /* of JUNIOR_WHEELS; in ms */
    uint8_t system, component;  /* of the host */
    uint8_t robot_system, robot_component;
    const uint8_t *greeting; /* frames that open the session, and arm */
    uint32_t greeting_length;

    /* For each ring. */
    const float *action;     /* shares of full speed, -1 to 1: left, right; what is beyond is at the limit */
    float *reading;          /* PILOT_NUMBERS counts as the wire has them: eyes, floor, way since the reading before in mm (at
                              * most 32), battery in mV, a number for each flag, time since the bout's first reading in ms */
    double *clearance;       /* m, from the opponent's centre to the border */
} kernel_pilot;

/* A bout begins: nothing is on the way. The next JUNIOR_WHEELS of the session has this sequence, the next frame that one. */
void pilot_begin(kernel_pilot *pilot, uint32_t ring, uint16_t sequence, uint8_t frame_sequence);

/* The last reading that has come is the bout's first: time and way are counted from here. */
void pilot_open(kernel_pilot *pilot, uint32_t ring);

/* Sends every Junior in whose ring time passes what `action` says. Returns 0 where one of it is no number: nothing is sent. */
uint8_t pilot_act(kernel_pilot *pilot);

/* Lives for at most so many control periods; a ring whose bout is decided lives no longer. Returns how many were lived for:
 * fewer where noise has been used up, as the rings' `stop` says. */
uint32_t pilot_live(kernel_pilot *pilot, uint32_t periods);

/* Both: a step. Returns what pilot_live does, or PILOT_REFUSED where nothing was sent. */
uint32_t pilot_step(kernel_pilot *pilot, uint32_t periods);

#endif
