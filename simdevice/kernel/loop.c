#include "loop.h"

#include <string.h>

static const uint32_t MANY = 0xFFFFFF; /* control periods: as many as the answer has room for */

/* A period takes one reading; it commands the wheels once, or twice where power is cut between two periods. */
static uint8_t has_noise(const kernel_loop *loop, uint32_t piece)
{
    const kernel_world *world = loop->world;

    return !loop->devices->running[piece] ||
           (world->reading_at[piece] < world->readings[piece] && world->error_at[piece] + 2 <= world->errors[piece]);
}

/* Every ring that time passes in has noise for a control period; those that have not are told by `stop`. */
static uint8_t have_noise(kernel_loop *loop)
{
    uint32_t pieces = loop->world->pieces, ring, piece;
    uint8_t enough = 1;

    for (ring = 0; ring < loop->rings; ring++) {
        loop->stop[ring] = 0;
        for (piece = pieces * ring; loop->living[ring] && piece < pieces * (ring + 1); piece++) {
            if (!has_noise(loop, piece)) {
                loop->stop[ring] = KERNEL_NOISE;
                enough = 0;
            }
        }
    }
    return enough;
}

static uint8_t tick(kernel_loop *loop, uint32_t piece, uint8_t held_up)
{
    kernel_world *world = loop->world;
    kernel_devices *devices = loop->devices;
    int16_t wheels[2];
    uint8_t rebooted;

    world_sense(world, piece, held_up);
    if (devices->dark[piece]) {
        world_command(world, piece, 0, 0);
        devices->rx_len[piece] = 0;
        devices->robot[piece]->io.tx_len = 0;
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
    return rebooted;
}

/* Adds bytes to what has been said. Returns where they end. */
static uint32_t say(kernel_loop *loop, uint32_t at, const uint8_t *data, uint32_t length)
{
    memcpy(loop->said + at, data, length);
    return at + length;
}

/* What a ring says after a control period. Returns what its `stop` gets for it; moves *at behind its words. */
static uint8_t speak(kernel_loop *loop, uint32_t ring, uint32_t *at)
{
    kernel_referees *referees = loop->referees;
    uint32_t junior = loop->world->pieces * ring, end = *at, length, spent;
    uint8_t due = 0;

    if (!loop->devices->running[junior]) {
        loop->answer_len[ring] = 0;
        return 0;
    }
    end = say(loop, end, loop->devices->robot[junior]->io.tx, loop->devices->robot[junior]->io.tx_len);
    if (referees->there[ring]) {
        if (loop->devices->system[junior] != referees->system[ring]) {
            referees->system[ring] = loop->devices->system[junior];
            referees->sequence[ring] = 0;
        }
        end = say(loop, end, loop->answer[ring], loop->answer_len[ring]);
        loop->answer_len[ring] = 0;
        spent = end - *at;
        if (referees_watch(referees, loop->world, ring) &&
            (loop->room[ring] == UINT32_MAX || loop->room[ring] >= spent + referees->longest)) {
            length = 0;
            if (referees->speaks) {
                double now = (double)loop->ticks[ring] * loop->world->period;

                length = referees_report(referees, loop->world, ring, now, loop->said + end);
            }
            end += length;
            due = length > 0 ? 0 : KERNEL_DUE;
        }
    }
    if (!loop->plugged[ring] || end == *at) {
        return due;
    }
    *at = end;
    return due | KERNEL_SAID;
}

static uint8_t live(kernel_loop *loop, uint32_t ring, uint32_t *at)
{
    uint32_t first = loop->world->pieces * ring, piece;
    uint8_t held_up = loop->world->lifted[ring] > 0, stop = 0;

    for (piece = first; piece < first + loop->world->pieces; piece++) {
        if (!loop->devices->running[piece]) {
            loop->devices->rx_len[piece] = 0;
        } else if (tick(loop, piece, held_up) && piece == first) {
            stop |= KERNEL_REBOOTED;
        } else if (piece != first && loop->hosted[ring] && loop->devices->robot[piece]->io.tx_len > 0) {
            stop |= KERNEL_SECOND; /* nobody listens to one that has no host */
        }
    }
    if (world_step(loop->world, ring)) {
        stop |= KERNEL_DECIDED;
    }
    loop->ticks[ring]++;
    return stop | speak(loop, ring, at);
}

uint8_t kernel_asked(kernel_loop *loop, const uint8_t *rx, uint32_t rx_len)
{
    uint32_t ring;
    uint8_t any = 0;

    for (ring = 0; ring < loop->rings; ring++) {
        loop->stop[ring] = loop->living[ring] && loop->plugged[ring] && loop->devices->running[loop->world->pieces * ring] &&
                           referees_asked(loop->referees, ring, rx, rx_len);
        any |= loop->stop[ring];
    }
    return any;
}

uint64_t kernel_run(kernel_loop *loop, const uint8_t *rx, uint32_t rx_len, uint32_t periods)
{
    uint32_t done, ring, at = 0;
    uint8_t stop = 0;

    periods = periods < MANY ? periods : MANY;
    for (done = 0; done < periods && !stop; done++) {
        if (!have_noise(loop)) {
            stop = KERNEL_NOISE;
            break;
        }
        for (ring = 0; ring < loop->rings; ring++) {
            if (loop->living[ring]) {
                if (rx_len > 0 && loop->plugged[ring]) {
                    loop->devices->rx[loop->world->pieces * ring] = rx;
                    loop->devices->rx_len[loop->world->pieces * ring] = rx_len;
                }
                stop |= loop->stop[ring] = live(loop, ring, &at);
            }
            loop->end[ring] = at;
        }
        rx_len = 0;
    }
    return (uint64_t)stop << 56 | (uint64_t)done << 32 | at;
}

void kernel_physics_alone(kernel_loop *loop, uint32_t periods)
{
    while (periods-- > 0) {
        loop->world->physics.space_step(loop->world->space[0], loop->world->period);
    }
}
