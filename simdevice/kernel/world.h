/* Rings with what stands in them, as arrays: it knows bodies, motors and sensors, and no firmware.
 *
 * Ring n holds `pieces` of them, from `pieces` n on: the first is a Junior, the second its opponent, a dummy or another Junior.
 * Where a piece has something on its left and its right, the left one is at 2 piece, the right one at 2 piece + 1; what it
 * knows of another one in its ring, the k-th, is at `pieces` piece + k. SI units; times are in s.
 * Bodies, joints and spaces are Chipmunk's, made by whoever fills the arrays; its functions are in physics.h. */
#ifndef KERNEL_WORLD_H
#define KERNEL_WORLD_H

#include "outline.h"
#include "physics.h"

typedef struct { /* a Junior's numbers, as simdevice/junior/{motors,sensors}.py work them out of a profile */
    double half_track, free_speed, stall_force, tyre_limit, slip, idle_current, current_per_force, fall, resistance;
    double per_volt, wheel_gain[2], command_noise;
    double eye_x, eye_y, cone[4], steepest, reach, eye_offset, eye_scale;
    double arm_span[2], press, release, behind;
    double floor_x, floor_y, floor_spot, floor_step, floor_beyond_x, floor_beyond_y;
} kernel_profile;

enum { KERNEL_DUMMY, KERNEL_ROVER };

typedef struct {
    kernel_physics physics;
    uint32_t pieces;
    double period, time_limit, half_x, half_y; /* a ring's half width and height */

    /* For each ring. */
    void **space;
    uint32_t *lifted, *steps; /* periods until everybody stands on the table; periods of the bout */
    uint8_t *outcome;         /* as BoutOutcome numbers them: 0 undecided, 1 win, 2 loss, 3 draw */

    /* For each piece: pose as of the last step. */
    uint8_t *kind;
    void **body;
    const kernel_outline **outline;
    double *x, *y, *angle, *cos, *sin;

    /* For each piece that is a dummy: its friction joints, at rest and sliding. */
    void **slide, **turn;
    double *still_slide, *still_turn, *kinetic_slide, *kinetic_turn, *grip, *moving;
    uint8_t *sliding;

    /* For each piece that is a Junior: its numbers, wheels, motors and battery. */
    const kernel_profile **profile;
    void **axle;
    double *last_x, *last_y, *last_angle, *held_x, *held_y, *ground;
    int16_t *command;                /* permille; left, right */
    double *effort, *force, *travel; /* left, right */
    double *full, *empty, *charge, *voltage, *share;
    const double **error;            /* standard normal deviates, for wheel commands */
    uint32_t *errors, *error_at;     /* how many there are, and which is the next */

    /* For each piece that is a Junior: sensors. */
    double *seen_x, *seen_y, *seen_cos, *seen_sin; /* of each other piece: where from it was measured last */
    double *seen, *gap;              /* of each other piece: of its eyes, of its arms; left, right */
    double *distance;                /* of the nearest thing that an eye sees; left, right */
    uint16_t *eye, *floor;           /* ADC counts; left, right */
    uint8_t *arm;                    /* left, right */
    const double **eye_noise;        /* ADC counts of an empty field: those of the left eye, then those of the right one */
    const uint16_t **floor_noise;    /* ADC counts of the bare ring likewise */
    uint32_t *readings, *reading_at; /* how many there are, and which is the next */
} kernel_world;

/* Takes a reading of a Junior's sensors; held up, it senses nothing of the others. There must be a reading left. */
void world_sense(kernel_world *world, uint32_t piece, uint8_t held_up);

/* A Junior has seen and touched nothing. */
void world_forget(kernel_world *world, uint32_t piece);

/* Sets a Junior's wheels, in permille. There must be two deviates left. */
void world_command(kernel_world *world, uint32_t piece, int16_t left, int16_t right);

/* A Junior's board boots: drivers off, encoders and ground odometer at zero; the battery stays as it is. */
void world_power_on(kernel_world *world, uint32_t piece);

/* One period of a ring's physics, and judgement. Returns 1 where it has decided the bout. */
uint8_t world_step(kernel_world *world, uint32_t ring);

#endif
