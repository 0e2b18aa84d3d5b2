/* It says what simdevice/sumo/referee.py says, byte for byte, and is to stay so. */
#include "referee.h"

#include <math.h>

#include "framing.h"
#include "order.h"

enum { RECORD = 16 };
enum { IDLE, RUNNING, OVER };

static const double TURN = 6.283185307179586;
static const frame_kind STATE = {MAVLINK_MSG_ID_REFEREE_STATE, MAVLINK_MSG_ID_REFEREE_STATE_LEN, MAVLINK_MSG_ID_REFEREE_STATE_CRC};

static uint8_t is_mine(uint32_t number)
{
    return number == MAVLINK_MSG_ID_COMMAND_LONG || number == MAVLINK_MSG_ID_REFEREE_RESET ||
           number == MAVLINK_MSG_ID_ROBOT_SESSION;
}

uint8_t referees_asked(const kernel_referees *referees, uint32_t ring, const uint8_t *rx, uint32_t length)
{
    uint32_t at = 0;

    if (!referees->there[ring]) {
        return 0;
    }
    if (referees->can) {
        for (; length - at >= RECORD; at += RECORD) {
            const uint8_t *record = rx + at;
            uint32_t id = record[0] | (uint32_t)record[1] << 8 | (uint32_t)record[2] << 16 | (uint32_t)record[3] << 24;

            if (referees->first <= id && id < referees->beyond) {
                return 1;
            }
        }
        return at < length;
    }
    if (!referees->whole[ring]) {
        return 1;
    }
    while (at < length) {
        const uint8_t *frame = rx + at;

        if (length - at < FRAME_HEADER || frame[0] != FRAME_MARKER || is_mine(frame_number(frame))) {
            return 1;
        }
        at += frame_length(frame);
    }
    return at != length;
}

uint8_t referees_watch(kernel_referees *referees, const kernel_world *world, uint32_t ring)
{
    referees->countdown[ring]--;
    return referees->countdown[ring] <= 0 || world->outcome[ring] != referees->decided[ring] ||
           referees->bout[ring] != referees->reported[ring];
}

/* A quantity as the wire has it, rounded half to even as Python rounds. Clears *fits where it is out of range. */
static int16_t raw(double value, uint8_t *fits)
{
    double counted = nearbyint(value * 1e4);

    if (!(-32768.0 <= counted && counted <= 32767.0)) {
        *fits = 0;
        return 0;
    }
    return (int16_t)counted;
}

static uint8_t fill(
    mavlink_referee_state_t *state, const kernel_referees *referees, const kernel_world *world, uint32_t ring, double now)
{
    uint32_t junior = world->pieces * ring, other = junior + 1;
    double clearance = least(world->half_x - fabs(world->x[other]), world->half_y - fabs(world->y[other]));
    uint8_t fits = 1, decided = world->outcome[ring];

    state->time = (uint64_t)nearbyint(now * 1e6);
    state->bout = referees->bout[ring];
    state->elapsed = (uint32_t)nearbyint(world->steps[ring] * world->period * 1e3);
    state->junior[0] = raw(world->x[junior], &fits);
    state->junior[1] = raw(world->y[junior], &fits);
    state->junior_heading = raw(remainder(world->angle[junior], TURN), &fits);
    state->opponent[0] = raw(world->x[other], &fits);
    state->opponent[1] = raw(world->y[other], &fits);
    state->opponent_heading = raw(remainder(world->angle[other], TURN), &fits);
    state->clearance = raw(clearance, &fits);
    state->phase = referees->bout[ring] == 0 ? IDLE : decided ? OVER : RUNNING;
    state->outcome = referees->bout[ring] == 0 ? 0 : decided;
    state->opponent_code = referees->opponent[ring];
    return fits;
}

uint32_t referees_report(kernel_referees *referees, const kernel_world *world, uint32_t ring, double now, uint8_t *frame)
{
    mavlink_referee_state_t state;

    if (!fill(&state, referees, world, ring, now)) {
        return 0;
    }
    if (referees->countdown[ring] <= 0) {
        referees->countdown[ring] = (int32_t)referees->every[ring];
    }
    referees->decided[ring] = world->outcome[ring];
    referees->reported[ring] = referees->bout[ring];
    return frame_make(frame, STATE, &state, referees->sequence[ring]++, referees->system[ring], referees->component);
}
