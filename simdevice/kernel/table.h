/* A table of micro-robots with all that stands on it, as arrays: it knows bodies, wheels and sensors, and no firmware.
 *
 * Row n is a robot; what has a left and a right has the left one at 2 n, the right one at 2 n + 1. SI units. The table's frame:
 * x right, y up, origin in the middle; a robot's: x along its nose, y left. Bodies and the space are Chipmunk's.
 *
 * A control period is: table_sense; for each robot its firmware, which may call table_ring, table_ranges, table_box and
 * table_goal and sets its wheels' commands; table_step. After a period in which `wanting` was set, more noise is due: whoever
 * gives it sets it back. */
#ifndef KERNEL_TABLE_H
#define KERNEL_TABLE_H

#include <stdint.h>

#include "physics.h"

enum { NOISE_SLIP, NOISE_FIX, NOISE_RANGE, NOISE_BOX, NOISE_GOAL, NOISE_KINDS }; /* of noise */
enum { TABLE_NO_BOX, TABLE_CYLINDER, TABLE_CUBE };
enum { TABLE_DIRECTIONS = 32, TABLE_BUMPERS = 8 };

typedef struct { /* what all robots have in common */
    double radius, half_track, mass, inertia;
    double traction, grip_torque; /* greatest force and torque of both wheels together */
    double lag;                   /* share of what is missing that a wheel's speed makes up in a period */
    double slip_sd, drift_sd;     /* of the wheels' factor; of the angle between nose and way */
    double fix_sd, fix_angle_sd;
    double lost_below;            /* a deviate below this begins a drop-out */
    uint32_t fix_periods, lost_fixes;
    double range_share_sd, range_sd, box_bearing_sd, box_distance_sd, goal_bearing_sd;
} table_profile;

typedef struct { /* standard normal deviates of one kind: `size` for each row, of which the next is number `at` */
    double *deviate;
    uint32_t *at;
    uint32_t size; /* 0: none is needed, all are zero */
} table_noise;

typedef struct {
    kernel_physics physics;
    table_profile profile;
    table_noise noise[5]; /* NOISE_KINDS of them */
    double period;
    void *space;
    uint32_t count;
    uint32_t periods;        /* since the reset */
    uint8_t wanting, starved; /* noise runs short; noise was read that was not there */

    /* For each robot: pose and velocity as of the last step. */
    void **body;
    double *x, *y, *angle, *cos, *sin, *vx, *vy, *spin;

    /* For each robot: what its firmware commands. */
    double *command; /* m/s; left, right */
    double *effort;  /* share of the traction that its thrust may use, 0..1 */

    /* For each robot: its wheels. */
    double *gain;              /* share of a command that a wheel turns; left, right */
    double *rim, *travel;      /* m/s, m since the reset; left, right */
    uint32_t *counted;         /* um that its encoders had counted before, modulo 2^32; left, right */
    double *slip, *way_cos, *way_sin; /* of the way that it is on */
    uint8_t *rolling;          /* it has been commanded to move in the last period */

    /* For each robot: what it senses. */
    uint8_t *group;            /* its class */
    double *gap;               /* contact is what is nearer to its edge than this; at most most_gap */
    double most_gap;
    uint8_t *bump;             /* a bit for each of 8 sectors of the body, the first one in the highest bit */
    uint8_t *touch;            /* it touches the box */
    double *fix_x, *fix_y, *fix_angle; /* the last position fix; the angle in -pi..pi */
    uint32_t *fix_age;         /* in periods; UINT32_MAX: never */
    uint32_t *lost;            /* fixes to come that will be lost */

    /* Obstacles: segments, and which of them may touch a robot in each cell of a grid. */
    double *wall;              /* x, y of one end, x, y of the other */
    uint32_t walls;
    double wall_x, wall_y, wall_cell; /* the grid's lowest corner, and the size of a cell */
    uint32_t wall_columns, wall_rows;
    uint32_t *wall_start, *wall_item;

    /* The box, and the goal. */
    uint8_t box_kind, has_goal;
    void *box;
    double box_half;           /* radius, or half a side */
    double box_x, box_y, box_angle, box_cos, box_sin, goal_x, goal_y;

    /* A grid of the robots as they stood when it was made, and the pairs that may have come into contact since. */
    double skin;               /* a robot that has moved by half of this makes the grid stale */
    double least_cell;
    uint8_t stale;
    double grid_x, grid_y, cell;
    uint32_t columns, rows, most_cells;
    uint32_t *cell_start, *cell_item, *cell_of;
    double *seen_x, *seen_y;   /* where each robot stood then */
    uint32_t *pair, pairs;     /* two rows each; room for every pair */

    /* What the last ring read: those around, in the order of their rows, and what its rays met. Room for all. */
    uint8_t occlusion;
    uint32_t found, *found_row;
    double *found_bearing, *found_distance;
    uint32_t near, *near_row;  /* candidates */
    double range[32];          /* infinite: nothing in range */
    uint32_t range_robots;     /* a bit for each direction in which what is hit is a robot; the first one in the lowest */
    double box_bearing, box_distance, goal_bearing; /* not a number: there is none */
} kernel_table;

/* A control period begins: contacts, and position fixes where they are due. */
void table_sense(kernel_table *table);

/* Reads a robot's ring: all robots nearer than a radius, into `found`. The radius is `least` where one of another class is
 * nearer than that or where `step` is 0; else by `step` more than the distance of the nearest one of another class, at most
 * `limit`, and at least `least`. */
void table_ring(kernel_table *table, uint32_t row, double least, double step, double limit);

/* Reads so many ranges of it, 0..32, up to a greatest distance, into `range` and `range_robots`. */
void table_ranges(kernel_table *table, uint32_t row, uint32_t directions, double farthest);

/* Reads its bearing of the box and the distance of the box's surface; its bearing of the goal. */
void table_box(kernel_table *table, uint32_t row);
void table_goal(kernel_table *table, uint32_t row);

/* A control period ends: wheels turn, bodies move. */
void table_step(kernel_table *table);

/* Lets the robots drive as they are commanded for at most so many control periods, until noise runs short. Returns how many it
 * were. */
uint32_t table_run(kernel_table *table, uint32_t periods);

/* Steps the physics and nothing else. */
void table_physics_alone(kernel_table *table, uint32_t periods);

/* The next deviates of a kind; there are `count` of them. */
const double *table_draw(kernel_table *table, uint32_t kind, uint32_t row, uint32_t count);

/* The distance from (x, y) to the surface of the box, and the nearest point of it; negative inside. */
double table_box_gap(const kernel_table *table, double x, double y, kernel_vector *nearest);

/* The distance from (x, y) to a wall, and the nearest point of it. */
double table_wall_gap(const kernel_table *table, uint32_t wall, double x, double y, kernel_vector *nearest);

/* Finds what touches the robots' bodies, into `bump` and `touch`. */
void table_contacts(kernel_table *table);

/* Makes the grid anew where robots have moved too far since. */
void table_refresh_grid(kernel_table *table);

/* Collects into `near`, in the order of their rows, all robots whose centres may be nearer to a robot than a radius. */
void table_collect(kernel_table *table, uint32_t row, double radius);

/* Square of the distance of the nearest robot of another class; what is farther than a limit need not be found: infinite. */
double table_nearest_other(const kernel_table *table, uint32_t row, double limit);

#endif
