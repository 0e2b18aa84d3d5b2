#include "loop.h"

/* A period takes one reading; it commands the wheels once, or twice where power is cut between two periods. */
static uint8_t has_noise(const kernel_loop *loop, uint32_t piece)
{
    const kernel_world *world = loop->world;

    return !loop->devices->running[piece] ||
           (world->reading_at[piece] < world->readings[piece] && world->error_at[piece] + 2 <= world->errors[piece]);
}

static uint8_t tick(kernel_loop *loop, uint32_t piece, uint32_t other, uint8_t held_up)
{
    kernel_world *world = loop->world;
    kernel_devices *devices = loop->devices;
    host_io *io = &devices->robot[piece]->io;
    int16_t wheels[2];
    uint8_t rebooted;

    world_sense(world, piece, other, held_up);
    if (devices->dark[piece]) {
        world_command(world, piece, 0, 0);
        devices->rx_len[piece] = 0;
        io->tx_len = 0;
        return 0;
    }
    devices_read(devices, piece, &world->eye[2 * piece], &world->floor[2 * piece], &world->arm[2 * piece]);
    devices_measure(devices, piece, world->voltage[piece], &world->travel[2 * piece], world->ground[piece]);
    rebooted = devices_tick(devices, piece, wheels);
    if (!held_up) {
        world_command(world, piece, wheels[0], wheels[1]);
    }
    if (rebooted) {
        world_power_on(world, piece);
    }
    return (uint8_t)((io->tx_len > 0 ? KERNEL_SENT : 0) | (rebooted ? KERNEL_REBOOTED : 0));
}

static uint8_t live(kernel_loop *loop, uint32_t ring)
{
    uint32_t junior = 2 * ring, other = junior + 1;
    uint8_t held_up = loop->world->lifted[ring] > 0, stop = 0;

    if (loop->devices->running[junior]) {
        stop = tick(loop, junior, other, held_up);
    } else {
        loop->devices->rx_len[junior] = 0;
    }
    if (loop->devices->running[other]) {
        tick(loop, other, junior, held_up); /* nobody listens to a second Junior */
    }
    if (world_step(loop->world, ring)) {
        stop |= KERNEL_DECIDED;
    }
    return stop;
}

uint32_t kernel_run(kernel_loop *loop, uint32_t periods)
{
    uint32_t done, ring;
    uint8_t stop = 0;

    for (done = 0; done < periods && !stop; done++) {
        for (ring = 0; ring < loop->rings; ring++) {
            loop->stop[ring] = 0;
            if (loop->living[ring] && !(has_noise(loop, 2 * ring) && has_noise(loop, 2 * ring + 1))) {
                return done;
            }
        }
        for (ring = 0; ring < loop->rings; ring++) {
            if (loop->living[ring]) {
                stop |= loop->stop[ring] = live(loop, ring);
            }
        }
    }
    return done;
}

void kernel_physics_alone(kernel_loop *loop, uint32_t periods)
{
    while (periods-- > 0) {
        loop->world->physics.space_step(loop->world->space[0], loop->world->period);
    }
}
