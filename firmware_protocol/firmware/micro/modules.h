/* What the modules of the role say to each other. Targets include micro.h only. */
#ifndef MICRO_MODULES_H
#define MICRO_MODULES_H

#include "core/core.h"
#include "micro/micro.h"
#include "micro/senses.h"

/* The core hands a role its robot, which is the head of this. */
static inline struct micro *micro_of(struct robot *robot)
{
    return (struct micro *)robot;
}

/* What a micro-robot understands besides what any robot does. */
union micro_inbound {
    union inbound any;
    mavlink_swarm_move_t move;
    mavlink_swarm_sense_t sense;
    mavlink_swarm_fix_t fix;
};

static inline const union micro_inbound *micro_inbound_of(const union inbound *message)
{
    return (const union micro_inbound *)message;
}

/* A parameter in its unit's thousandths; they reach to 65.535. */
static inline uint16_t micro_milli(const struct micro *micro, uint8_t index)
{
    return (uint16_t)params_get(&micro->robot, index);
}

enum { ANGLE_NONE = INT16_MIN /* on the wire */, UM_PER_MM = 1000 };
#define LENGTH_NONE UINT16_MAX /* on the wire; of a radius: without end */

/* Counters that wrap. */
static inline int32_t micro_sum(int32_t one, int32_t other)
{
    return (int32_t)((uint32_t)one + (uint32_t)other);
}

static inline int32_t micro_difference(int32_t one, int32_t other)
{
    return (int32_t)((uint32_t)one - (uint32_t)other);
}

/* angles.c: 65536 are a turn; a sine of 1 is 32767. */
int16_t angles_sine(uint16_t angle);
int16_t angles_cosine(uint16_t angle);
uint16_t angles_of(int32_t y, int32_t x);           /* of a vector; not longer than 2^30 either way */
int32_t angles_scale(int32_t value, int16_t factor); /* value * factor / 32767, nearly */
uint16_t angles_from_wire(int16_t angle);
int16_t angles_to_wire(uint16_t angle);
uint16_t angles_from_milli(uint16_t angle); /* mrad, 0..3000 */
static inline uint16_t angles_size(uint16_t angle) /* without its sign */
{
    return angle > 32768U ? (uint16_t)(0U - angle) : angle;
}

/* pose.c */
void pose_start(struct micro *micro);
void pose_step(struct micro *micro);
void pose_fix(struct micro *micro, const struct hal_fix *fix);
uint16_t pose_heading(const struct micro *micro);
uint16_t pose_age(const struct micro *micro); /* of the fix, ms; LENGTH_NONE: there was none */
bool pose_known(const struct micro *micro);   /* by a fix that counts */
int16_t pose_mm(int32_t um);

/* fence.c */
bool fence_there(const struct micro *micro);
bool fence_leaves(const struct micro *micro, uint16_t way, uint16_t distance); /* mm: ends outside, and no nearer */
/* Outside, and going outward: by its way, or since it was turned off it. The heading is the one that it drives to. */
bool fence_crossed(const struct micro *micro, uint16_t way, uint16_t heading);

/* move.c */
uint8_t move_request(struct micro *micro, const mavlink_swarm_move_t *request); /* Reason */
void move_step(struct micro *micro);
void move_interrupt(struct micro *micro, uint8_t event, uint8_t reason);
void move_drop(struct micro *micro);   /* its observation is not repeated any more */
void move_repeat(struct micro *micro); /* its observation is sent again */
bool move_contact_ahead(const struct micro *micro);

/* ring.c */
void ring_start(struct micro *micro);
void ring_ask(struct micro *micro);
void ring_step(struct micro *micro);
bool ring_fitted(const struct micro *micro);
uint8_t ring_sense(struct micro *micro, const mavlink_swarm_sense_t *request); /* Reason */
const struct ring_setting *ring_setting(struct micro *micro);

/* observation.c */
enum { STREAM_OBSERVATION, STREAM_RANGES }; /* among the role's */
void observation_end(struct micro *micro, bool sensed); /* of the move, as it has ended */
void observation_send_now(struct micro *micro);         /* the same, once */
void observation_report(struct micro *micro);
void observation_pass(struct micro *micro); /* there is news: what has not been said yet is said, and nothing is repeated */
uint8_t observation_ask(struct micro *micro, uint8_t stream, const mavlink_command_long_t *command); /* MAV_RESULT */
bool observation_answer(struct micro *micro, uint8_t stream);

#endif
