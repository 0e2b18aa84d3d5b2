#include "pilot.h"

#include <math.h>
#include <string.h>

#include "framing.h"
#include "order.h"

enum { FARTHEST = 32, UNDECIDED = 0, NUMBER_EYES = 0, NUMBER_FLOOR = 2, NUMBER_TRAVEL = 4, NUMBER_BATTERY = 6, NUMBER_FLAGS = 7 };
enum { NUMBER_TIME = NUMBER_FLAGS + PILOT_FLAGS };

static const frame_kind WHEELS = {MAVLINK_MSG_ID_JUNIOR_WHEELS, MAVLINK_MSG_ID_JUNIOR_WHEELS_LEN, MAVLINK_MSG_ID_JUNIOR_WHEELS_CRC};

typedef char senses_fit[MAVLINK_MSG_ID_JUNIOR_SENSORS_LEN == PILOT_SENSES ? 1 : -1];
typedef char numbers_fit[NUMBER_TIME + 1 == PILOT_NUMBERS ? 1 : -1];

void pilot_begin(kernel_pilot *pilot, uint32_t ring, uint16_t sequence, uint8_t frame_sequence)
{
    pilot_line *line = &pilot->line[ring];

    memset(line, 0, sizeof *line);
    line->sequence = sequence;
    line->frame_sequence = frame_sequence;
}

void pilot_open(kernel_pilot *pilot, uint32_t ring)
{
    pilot_line *line = &pilot->line[ring];
    float *reading = &pilot->reading[PILOT_NUMBERS * ring];

    line->open = 1;
    line->began = line->time;
    reading[NUMBER_TRAVEL] = reading[NUMBER_TRAVEL + 1] = reading[NUMBER_TIME] = 0.0F;
}

/* Half to even, as Python rounds. */
static int16_t permille(float share)
{
    return (int16_t)nearbyint(most(-1.0, least(1.0, (double)share)) * 1e3);
}

static void order(kernel_pilot *pilot, uint32_t ring)
{
    pilot_line *line = &pilot->line[ring];
    pilot_order *made;

    if (line->down_count == PILOT_WAITING) {
        return; /* unreachable: so much is never on the way */
    }
    made = &line->down[(line->down_first + line->down_count++) % PILOT_WAITING];
    made->due = pilot->loop->ticks[ring] + pilot->delay;
    made->speed[0] = permille(pilot->action[2 * ring]);
    made->speed[1] = permille(pilot->action[2 * ring + 1]);
    made->greeting = line->lost;
    line->lost = 0;
}

uint8_t pilot_act(kernel_pilot *pilot)
{
    uint32_t ring;

    for (ring = 0; ring < pilot->loop->rings; ring++) {
        if (pilot->loop->living[ring] && (isnan(pilot->action[2 * ring]) || isnan(pilot->action[2 * ring + 1]))) {
            return 0;
        }
    }
    for (ring = 0; ring < pilot->loop->rings; ring++) {
        if (pilot->loop->living[ring]) {
            order(pilot, ring);
        }
    }
    return 1;
}

static uint32_t write_wheels(kernel_pilot *pilot, pilot_line *line, const pilot_order *due, uint8_t *frame)
{
    mavlink_junior_wheels_t wheels;

    wheels.session = pilot->session;
    wheels.sequence = line->sequence++;
    wheels.speed[0] = due->speed[0];
    wheels.speed[1] = due->speed[1];
    wheels.duration = pilot->duration;
    wheels.target_system = pilot->robot_system;
    wheels.target_component = pilot->robot_component;
    return frame_make(frame, WHEELS, &wheels, line->frame_sequence++, pilot->system, pilot->component);
}

/* Lets what has come down the line be received in the next control period; orders are further apart than that. */
static void deliver(kernel_pilot *pilot, uint32_t ring)
{
    pilot_line *line = &pilot->line[ring];
    const pilot_order *due = &line->down[line->down_first];
    uint32_t junior = pilot->loop->world->pieces * ring, length = 0;

    if (line->down_count == 0 || due->due > pilot->loop->ticks[ring]) {
        return;
    }
    if (due->greeting) {
        memcpy(line->frame, pilot->greeting, pilot->greeting_length);
        length = pilot->greeting_length;
        line->sequence = 1;
    }
    length += write_wheels(pilot, line, due, line->frame + length);
    line->down_first = (line->down_first + 1) % PILOT_WAITING;
    line->down_count--;
    pilot->loop->devices->rx[junior] = line->frame;
    pilot->loop->devices->rx_len[junior] = length;
}

static float bounded(int32_t way)
{
    return (float)(way < -FARTHEST ? -FARTHEST : way > FARTHEST ? FARTHEST : way);
}

static void read(kernel_pilot *pilot, uint32_t ring, const uint8_t *senses)
{
    pilot_line *line = &pilot->line[ring];
    float *reading = &pilot->reading[PILOT_NUMBERS * ring];
    mavlink_junior_sensors_t sensors;
    int side, flag;

    memcpy(&sensors, senses, PILOT_SENSES);
    if (line->open && sensors.time < line->time) { /* it has booted: clock and encoders have begun anew */
        line->lost = 1;
        line->began = sensors.time - (line->time - line->began);
        line->travel[0] = line->travel[1] = 0;
    }
    for (side = 0; side < 2; side++) {
        reading[NUMBER_EYES + side] = sensors.eye[side];
        reading[NUMBER_FLOOR + side] = sensors.floor[side];
        reading[NUMBER_TRAVEL + side] = bounded((int32_t)((uint32_t)sensors.travel[side] - (uint32_t)line->travel[side]));
        line->travel[side] = sensors.travel[side];
    }
    reading[NUMBER_BATTERY] = sensors.battery;
    for (flag = 0; flag < PILOT_FLAGS; flag++) {
        reading[NUMBER_FLAGS + flag] = (float)(sensors.flags >> flag & 1);
    }
    line->time = sensors.time;
    reading[NUMBER_TIME] = (float)((line->time - line->began) / 1000);
    line->heard = 1;
}

/* Puts what a Junior has sent on the line, as far as it is a reading; takes what has come up. */
static void listen(kernel_pilot *pilot, uint32_t ring)
{
    pilot_line *line = &pilot->line[ring];
    uint32_t junior = pilot->loop->world->pieces * ring, at = 0, end;
    const uint8_t *tx = pilot->loop->devices->robot[junior]->io.tx;

    end = pilot->loop->devices->running[junior] && !pilot->loop->devices->dark[junior]
              ? pilot->loop->devices->robot[junior]->io.tx_len
              : 0;
    for (; at < end; at += frame_length(tx + at)) {
        if (frame_number(tx + at) == MAVLINK_MSG_ID_JUNIOR_SENSORS && line->up_count < PILOT_WAITING) {
            pilot_word *word = &line->up[(line->up_first + line->up_count++) % PILOT_WAITING];

            word->due = pilot->loop->ticks[ring] + pilot->delay;
            memset(word->senses, 0, sizeof word->senses);
            memcpy(word->senses, tx + at + FRAME_HEADER, tx[at + 1]);
        }
    }
    line->heard = 0;
    while (line->up_count > 0 && line->up[line->up_first].due <= pilot->loop->ticks[ring]) {
        read(pilot, ring, line->up[line->up_first].senses);
        line->up_first = (line->up_first + 1) % PILOT_WAITING;
        line->up_count--;
    }
}

static void look(kernel_pilot *pilot, uint32_t ring)
{
    const kernel_world *world = pilot->loop->world;
    uint32_t other = world->pieces * ring + 1;

    pilot->clearance[ring] = least(world->half_x - fabs(world->x[other]), world->half_y - fabs(world->y[other]));
    if (world->outcome[ring] != UNDECIDED) {
        pilot->loop->living[ring] = 0;
    }
}

uint32_t pilot_live(kernel_pilot *pilot, uint32_t periods)
{
    kernel_loop *loop = pilot->loop;
    uint32_t done, ring;

    for (done = 0; done < periods; done++) {
        for (ring = 0; ring < loop->rings; ring++) {
            if (loop->living[ring]) {
                deliver(pilot, ring);
            }
        }
        if ((kernel_run(loop, NULL, 0, 1) >> 32 & 0xFFFFFF) == 0) {
            break;
        }
        for (ring = 0; ring < loop->rings; ring++) {
            if (loop->living[ring]) {
                listen(pilot, ring);
                look(pilot, ring);
            }
        }
    }
    return done;
}

uint32_t pilot_step(kernel_pilot *pilot, uint32_t periods)
{
    return pilot_act(pilot) ? pilot_live(pilot, periods) : PILOT_REFUSED;
}
