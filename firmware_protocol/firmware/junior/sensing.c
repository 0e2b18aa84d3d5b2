/* From counts and switches to decisions: eyes see, arms are pressed and hold, the floor ends. Travel is kept here too. */
#include "junior/modules.h"

enum { UM_PER_MM = 1000 };

static const uint8_t eye_on[2] = {JUNIOR_PARAM_EYE_L_ON, JUNIOR_PARAM_EYE_R_ON};
static const uint8_t floor_off[2] = {JUNIOR_PARAM_FLOOR_L_OFF, JUNIOR_PARAM_FLOOR_R_OFF};

static bool has(const struct sensing *sensing, uint16_t flag)
{
    return (sensing->flags & flag) != 0;
}

static void put(struct sensing *sensing, uint16_t flag, bool on)
{
    sensing->flags = (uint16_t)(on ? sensing->flags | flag : sensing->flags & (uint16_t)~flag);
}

/* Sees at or above the threshold, ceases to see when below it by more than the hysteresis. */
static void read_eye(struct junior *junior, uint8_t side)
{
    struct sensing *sensing = &junior->sensing;
    uint16_t flag = (uint16_t)(JUNIOR_SENSOR_FLAG_EYE_LEFT << side);
    int16_t threshold = params_get(&junior->robot, eye_on[side]);

    if (has(sensing, flag)) {
        threshold = (int16_t)(threshold - params_get(&junior->robot, JUNIOR_PARAM_EYE_HYST));
    }
    sensing->eye[side] = failure_read(&junior->robot, (uint8_t)(FAILURE_EYE + side), hal_eye(junior->robot.board, side),
                                      sensing->eye[side]);
    put(sensing, flag, (int16_t)sensing->eye[side] >= threshold);
}

static void read_floor(struct junior *junior, uint8_t side)
{
    struct sensing *sensing = &junior->sensing;
    bool above;

    sensing->floor[side]
        = failure_read(&junior->robot, (uint8_t)(FAILURE_FLOOR + side), hal_floor(junior->robot.board, side),
                       sensing->floor[side]);
    above = (int16_t)sensing->floor[side] >= params_get(&junior->robot, floor_off[side]);
    put(sensing, (uint16_t)(JUNIOR_SENSOR_FLAG_OFF_RING_LEFT << side),
        above != (params_get(&junior->robot, JUNIOR_PARAM_FLOOR_INVERT) != 0));
}

/* A switch counts once it has been steady for ARM_DEBOUNCE; pressed for ARM_HOLD, it holds. */
static void read_arm(struct junior *junior, uint8_t side)
{
    struct sensing *sensing = &junior->sensing;
    struct arm *arm = &sensing->arm[side];
    uint16_t flag = (uint16_t)(JUNIOR_SENSOR_FLAG_ARM_LEFT << side);
    uint8_t closed = hal_arm(junior->robot.board, side) != 0;
    uint8_t raw = failure_read(&junior->robot, (uint8_t)(FAILURE_ARM + side), closed, arm->raw) & 1U;
    uint32_t now = junior->robot.time.now;

    if (raw != arm->raw) {
        arm->raw = raw;
        arm->raw_since = now;
    }
    if (raw != has(sensing, flag)
        && now - arm->raw_since >= (uint32_t)params_get(&junior->robot, JUNIOR_PARAM_ARM_DEBOUNCE)) {
        put(sensing, flag, raw);
        arm->pressed_since = now;
        if (raw) {
            sensing->edges |= (uint8_t)(1U << side);
        }
    }
    put(sensing, (uint16_t)(JUNIOR_SENSOR_FLAG_HELD_LEFT << side),
        has(sensing, flag) && now - arm->pressed_since >= (uint32_t)params_get(&junior->robot, JUNIOR_PARAM_ARM_HOLD));
}

/* Wraps as the encoder does: differences are taken without a sign. */
static int32_t moved(int32_t now, int32_t *before)
{
    int32_t difference = (int32_t)((uint32_t)now - (uint32_t)*before);

    *before = now;
    return difference;
}

static void read_travel(struct junior *junior, uint8_t side)
{
    struct sensing *sensing = &junior->sensing;
    int32_t um;

    if (has(sensing, JUNIOR_SENSOR_FLAG_TRAVEL_FROM_ENCODERS)) {
        um = moved(hal_travel(junior->robot.board, side), &sensing->encoder[side]);
    } else if (junior->robot.wheels.effort[side] == 0) {
        return;
    } else {
        um = (int32_t)junior->robot.wheels.effort[side] * params_get(&junior->robot, JUNIOR_PARAM_WHEEL_SPEED) / 1000
             * junior->robot.time.elapsed;
    }
    if (um == 0) {
        return;
    }
    sensing->travel_mm[side] = (int32_t)((uint32_t)sensing->travel_mm[side] + (uint32_t)(um / UM_PER_MM));
    um = um % UM_PER_MM + sensing->travel_um[side];
    sensing->travel_mm[side] = (int32_t)((uint32_t)sensing->travel_mm[side] + (uint32_t)(um / UM_PER_MM));
    sensing->travel_um[side] = (int16_t)(um % UM_PER_MM);
}

void sensing_start(struct junior *junior)
{
    struct sensing *sensing = &junior->sensing;

    put(sensing, JUNIOR_SENSOR_FLAG_TRAVEL_FROM_ENCODERS, hal_has_encoders(junior->robot.board));
    put(sensing, JUNIOR_SENSOR_FLAG_GROUND_ODOMETER, hal_has_ground(junior->robot.board));
    sensing->encoder[LEFT] = hal_travel(junior->robot.board, LEFT);
    sensing->encoder[RIGHT] = hal_travel(junior->robot.board, RIGHT);
    sensing->ground = hal_ground(junior->robot.board);
}

void sensing_tick(struct junior *junior)
{
    struct sensing *sensing = &junior->sensing;
    uint8_t side;

    sensing->edges = 0;
    for (side = LEFT; side <= RIGHT; side++) {
        read_eye(junior, side);
        read_floor(junior, side);
        read_arm(junior, side);
        read_travel(junior, side);
    }
    sensing->ground_moved = moved(hal_ground(junior->robot.board), &sensing->ground);
}

bool sensing_send(struct junior *junior)
{
    const struct sensing *sensing = &junior->sensing;
    mavlink_junior_sensors_t sensors;

    sensors.time = junior->robot.time.micros;
    memcpy(sensors.travel, sensing->travel_mm, sizeof sensors.travel);
    memcpy(sensors.eye, sensing->eye, sizeof sensors.eye);
    memcpy(sensors.floor, sensing->floor, sizeof sensors.floor);
    sensors.battery = junior->robot.battery;
    sensors.flags = sensing->flags;
    return SEND(&junior->robot, JUNIOR_SENSORS, &sensors);
}

uint8_t sensing_stimulus(const struct junior *junior)
{
    return (uint8_t)(junior->sensing.flags & 15U);
}

uint8_t sensing_off_ring(const struct junior *junior)
{
    return (uint8_t)(junior->sensing.flags / JUNIOR_SENSOR_FLAG_OFF_RING_LEFT & 3U);
}
