/* The arithmetic is that of simdevice/{junior/motors,arena,sumo/match}.py, operation by operation, and is to stay so. */
#include "world.h"

#include <math.h>

#include "order.h"

static const double HOLD = 0.001; /* m */
static const double WEAK = 1e-6;  /* N */

enum { UNDECIDED, WIN, LOSS, DRAW };

static void set_wheel(kernel_world *world, uint32_t piece, int side, int16_t command)
{
    const kernel_profile *profile = world->profile[piece];
    uint32_t wheel = 2 * piece + (uint32_t)side;
    double error;

    if (command != world->command[wheel]) {
        error = 1.0 + profile->command_noise * world->error[piece][world->error_at[piece]++];
        world->effort[wheel] = command * 1e-3 * profile->wheel_gain[side] * error;
    }
    world->command[wheel] = command;
}

void world_command(kernel_world *world, uint32_t piece, int16_t left, int16_t right)
{
    set_wheel(world, piece, 0, left);
    set_wheel(world, piece, 1, right);
}

void world_power_on(kernel_world *world, uint32_t piece)
{
    uint32_t wheel;

    for (wheel = 2 * piece; wheel < 2 * piece + 2; wheel++) {
        world->command[wheel] = 0;
        world->effort[wheel] = 0.0;
        world->travel[wheel] = 0.0;
    }
    world->ground[piece] = 0.0;
}

/* Works out the forces of one period, from the speeds of the ground under the wheels. */
static void turn(kernel_world *world, uint32_t piece, double left, double right)
{
    const kernel_profile *profile = world->profile[piece];
    double *force = &world->force[2 * piece], *travel = &world->travel[2 * piece], speed[2], current;
    int side;

    speed[0] = left;
    speed[1] = right;
    for (side = 0; side < 2; side++) {
        double limit = profile->tyre_limit, effort = world->effort[2 * piece + (uint32_t)side];
        double wanted = profile->stall_force * (effort * world->share[piece] - speed[side] / profile->free_speed);

        if (wanted > limit) {
            speed[side] += (wanted - limit) * profile->slip;
            wanted = limit;
        } else if (wanted < -limit) {
            speed[side] += (wanted + limit) * profile->slip;
            wanted = -limit;
        }
        force[side] = wanted;
    }
    travel[0] += speed[0] * world->period;
    travel[1] += speed[1] * world->period;
    current = profile->idle_current + profile->current_per_force * (fabs(force[0]) + fabs(force[1]));
    world->charge[piece] += current * world->period;
    world->voltage[piece] =
        most(world->empty[piece], world->full[piece] - world->charge[piece] * profile->fall) - current * profile->resistance;
    world->share[piece] = world->voltage[piece] * profile->per_volt;
}

static void drive(kernel_world *world, uint32_t piece)
{
    double x = world->x[piece], y = world->y[piece], half = world->profile[piece]->half_track, rate = 1 / world->period;
    double ahead = (x - world->last_x[piece]) * world->cos[piece] + (y - world->last_y[piece]) * world->sin[piece];
    double lead = (world->angle[piece] - world->last_angle[piece]) * half;
    double left, right, push;

    world->last_x[piece] = x;
    world->last_y[piece] = y;
    world->last_angle[piece] = world->angle[piece];
    world->ground[piece] += ahead;
    turn(world, piece, (ahead - lead) * rate, (ahead + lead) * rate);
    left = world->force[2 * piece];
    right = world->force[2 * piece + 1];
    push = left + right;
    if (-WEAK < push && push < WEAK) {
        world->physics.set_torque(world->body[piece], (right - left) * half);
    } else { /* one force off the middle line is both push and torque */
        kernel_vector force = {0.0, 0.0}, point = {0.0, 0.0};

        force.x = push;
        point.y = (left - right) * half / push;
        world->physics.apply_force(world->body[piece], force, point);
    }
    if (!(-HOLD < x - world->held_x[piece] && x - world->held_x[piece] < HOLD && -HOLD < y - world->held_y[piece] &&
          y - world->held_y[piece] < HOLD)) {
        kernel_vector held;

        held.x = world->held_x[piece] = x;
        held.y = world->held_y[piece] = y;
        world->physics.set_anchor_b(world->axle[piece], held);
    }
}

/* Chooses static or kinetic friction by the way that a dummy has made. */
static void rub(kernel_world *world, uint32_t piece, double way_x, double way_y, double turned)
{
    double grip = world->grip[piece], square = way_x * way_x + way_y * way_y + turned * turned * grip * grip;
    uint8_t sliding = square > world->moving[piece];

    if (sliding == world->sliding[piece]) {
        return;
    }
    world->sliding[piece] = sliding;
    world->physics.set_max_force(world->slide[piece], sliding ? world->kinetic_slide[piece] : world->still_slide[piece]);
    world->physics.set_max_force(world->turn[piece], sliding ? world->kinetic_turn[piece] : world->still_turn[piece]);
}

static void refresh(kernel_world *world, uint32_t piece)
{
    kernel_vector at = world->physics.position(world->body[piece]);
    double angle = world->physics.angle(world->body[piece]), turned = angle - world->angle[piece];
    double way_x = at.x - world->x[piece], way_y = at.y - world->y[piece];

    world->x[piece] = at.x;
    world->y[piece] = at.y;
    if (turned != 0.0) {
        world->angle[piece] = angle;
        world->cos[piece] = cos(angle);
        world->sin[piece] = sin(angle);
    }
    if (world->kind[piece] == KERNEL_DUMMY) {
        rub(world, piece, way_x, way_y, turned);
    }
}

static uint8_t inside(const kernel_world *world, uint32_t piece)
{
    return -world->half_x <= world->x[piece] && world->x[piece] <= world->half_x && -world->half_y <= world->y[piece] &&
           world->y[piece] <= world->half_y;
}

static uint8_t judge(kernel_world *world, uint32_t ring)
{
    uint8_t lost = !inside(world, world->pieces * ring), won = !inside(world, world->pieces * ring + 1);

    if (won || lost) {
        world->outcome[ring] = won && lost ? DRAW : won ? WIN : LOSS;
    } else if (world->steps[ring] * world->period >= world->time_limit) {
        world->outcome[ring] = DRAW;
    }
    return world->outcome[ring] != UNDECIDED;
}

uint8_t world_step(kernel_world *world, uint32_t ring)
{
    uint32_t first = world->pieces * ring, end = first + world->pieces, piece;

    if (world->lifted[ring] > 0) {
        world->lifted[ring]--;
        return 0;
    }
    for (piece = first; piece < end; piece++) {
        if (world->kind[piece] == KERNEL_ROVER) {
            drive(world, piece);
        }
    }
    world->physics.space_step(world->space[ring], world->period);
    for (piece = first; piece < end; piece++) {
        refresh(world, piece);
    }
    if (world->outcome[ring] != UNDECIDED) {
        return 0;
    }
    world->steps[ring]++;
    return judge(world, ring);
}
