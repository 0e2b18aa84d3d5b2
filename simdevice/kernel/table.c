#include "table.h"

#include <math.h>

static const double TURN = 6.283185307179586; /* a full one, in rad */
static const double STANDING = 1e-7;          /* m/s, rad/s: below this, wheels that are to stand do, and no force is worth it */
static const uint32_t RESERVE = 4;            /* draws that must be left after a period */

static const double *nothing(void)
{
    static const double zeros[2 * TABLE_DIRECTIONS];

    return zeros;
}

const double *table_draw(kernel_table *table, uint32_t kind, uint32_t row, uint32_t count)
{
    table_noise *noise = &table->noise[kind];
    uint32_t at;

    if (noise->size == 0) {
        return nothing();
    }
    at = noise->at[row];
    if (at + count > noise->size) {
        table->starved = 1;
        return nothing();
    }
    noise->at[row] = at + count;
    if (at + count + RESERVE * count > noise->size) {
        table->wanting = 1;
    }
    return noise->deviate + (uint64_t)row * noise->size + at;
}

/* Begins a way: how the wheels slip on it, and how far it is off the nose. */
static void set_out(kernel_table *table, uint32_t row)
{
    const double *deviate = table_draw(table, NOISE_SLIP, row, 2);
    double drift = table->profile.drift_sd * deviate[1];

    table->slip[row] = 1.0 + table->profile.slip_sd * deviate[0];
    table->way_cos[row] = cos(drift);
    table->way_sin[row] = sin(drift);
}

/* Turns the wheels. Returns 1 where one of them turns. */
static uint8_t turn(kernel_table *table, uint32_t row)
{
    const double *command = &table->command[2 * row], *gain = &table->gain[2 * row];
    double *rim = &table->rim[2 * row], *travel = &table->travel[2 * row];
    uint8_t rolling = command[0] != 0.0 || command[1] != 0.0;
    int side;

    if (rolling && !table->rolling[row]) {
        set_out(table, row);
    }
    table->rolling[row] = rolling;
    if (!rolling && rim[0] == 0.0 && rim[1] == 0.0) {
        return 0;
    }
    for (side = 0; side < 2; side++) {
        double wanted = command[side] * gain[side];

        rim[side] += (wanted - rim[side]) * table->profile.lag;
        if (wanted == 0.0 && -STANDING < rim[side] && rim[side] < STANDING) {
            rim[side] = 0.0;
        }
        travel[side] += rim[side] * table->period;
    }
    return 1;
}

/* The tyres bring the body to the wheels' velocity, as far as their grip goes. */
static void drive(kernel_table *table, uint32_t row)
{
    const table_profile *profile = &table->profile;
    double c = table->cos[row], s = table->sin[row], ahead = 0.0, lead = 0.0, thrust, side, square, torque, limit;
    kernel_vector force;

    if (turn(table, row)) {
        const double *rim = &table->rim[2 * row];
        double slip = table->slip[row];

        ahead = slip * (rim[0] + rim[1]) * 0.5;
        lead = slip * (rim[1] - rim[0]) / (2.0 * profile->half_track);
    }
    /* What is missing, in the robot's frame. */
    thrust = ahead * table->way_cos[row] - (table->vx[row] * c + table->vy[row] * s);
    side = ahead * table->way_sin[row] - (table->vy[row] * c - table->vx[row] * s);
    torque = lead - table->spin[row];
    if (-STANDING < thrust && thrust < STANDING && -STANDING < side && side < STANDING && -STANDING < torque && torque < STANDING) {
        return;
    }
    thrust *= profile->mass / table->period;
    side *= profile->mass / table->period;
    torque *= profile->inertia / table->period;
    limit = profile->traction * table->effort[row];
    thrust = limit < thrust ? limit : thrust < -limit ? -limit : thrust;
    limit = profile->traction;
    square = thrust * thrust + side * side;
    if (square > limit * limit) {
        double share = limit / sqrt(square);

        thrust *= share;
        side *= share;
    }
    limit = profile->grip_torque;
    torque = limit < torque ? limit : torque < -limit ? -limit : torque;
    force.x = thrust * c - side * s;
    force.y = thrust * s + side * c;
    table->physics.set_force(table->body[row], force);
    table->physics.set_torque(table->body[row], torque);
}

static void refresh(kernel_table *table)
{
    const kernel_physics *physics = &table->physics;
    double farthest = table->skin * table->skin * 0.25;
    uint32_t row;

    for (row = 0; row < table->count; row++) {
        void *body = table->body[row];
        kernel_vector at = physics->position(body), velocity = physics->velocity(body);
        kernel_vector rotation = physics->rotation(body);
        double dx = at.x - table->seen_x[row], dy = at.y - table->seen_y[row];

        table->x[row] = at.x;
        table->y[row] = at.y;
        table->vx[row] = velocity.x;
        table->vy[row] = velocity.y;
        table->spin[row] = physics->spin(body);
        table->angle[row] = physics->angle(body);
        table->cos[row] = rotation.x;
        table->sin[row] = rotation.y;
        if (!(dx * dx + dy * dy < farthest)) {
            table->stale = 1;
        }
    }
    if (table->box_kind != TABLE_NO_BOX) {
        kernel_vector at = physics->position(table->box), rotation = physics->rotation(table->box);

        table->box_x = at.x;
        table->box_y = at.y;
        table->box_angle = physics->angle(table->box);
        table->box_cos = rotation.x;
        table->box_sin = rotation.y;
    }
}

void table_step(kernel_table *table)
{
    uint32_t row;

    for (row = 0; row < table->count; row++) {
        drive(table, row);
    }
    table->physics.space_step(table->space, table->period);
    refresh(table);
    table->periods++;
}

/* Position fixes are due: every robot draws, whether its fix is lost or not. */
static void fix(kernel_table *table)
{
    const table_profile *profile = &table->profile;
    uint32_t row;

    for (row = 0; row < table->count; row++) {
        const double *deviate = table_draw(table, NOISE_FIX, row, 4);

        if (table->lost[row] > 0) {
            table->lost[row]--;
        } else if (deviate[3] < profile->lost_below) {
            table->lost[row] = profile->lost_fixes - 1;
        } else {
            table->fix_x[row] = table->x[row] + profile->fix_sd * deviate[0];
            table->fix_y[row] = table->y[row] + profile->fix_sd * deviate[1];
            table->fix_angle[row] = remainder(table->angle[row] + profile->fix_angle_sd * deviate[2], TURN);
            table->fix_age[row] = 0;
        }
    }
}

void table_sense(kernel_table *table)
{
    uint32_t row;

    for (row = 0; row < table->count; row++) {
        if (table->fix_age[row] != UINT32_MAX) {
            table->fix_age[row]++;
        }
    }
    if (table->periods % table->profile.fix_periods == 0) {
        fix(table);
    }
    table_contacts(table);
}

uint32_t table_run(kernel_table *table, uint32_t periods)
{
    uint32_t done = 0;

    while (done < periods && !table->wanting) {
        table_sense(table);
        table_step(table);
        done++;
    }
    return done;
}

void table_physics_alone(kernel_table *table, uint32_t periods)
{
    while (periods-- > 0) {
        table->physics.space_step(table->space, table->period);
    }
}
