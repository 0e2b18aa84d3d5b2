/* What the modules of the role say to each other. Targets include junior.h only. */
#ifndef JUNIOR_MODULES_H
#define JUNIOR_MODULES_H

#include "core/core.h"
#include "junior/junior.h"
#include "junior/senses.h"

/* The core hands a role its robot, which is the head of this. */
static inline struct junior *junior_of(struct robot *robot)
{
    return (struct junior *)robot;
}

/* What Junior understands besides what any robot does. */
union junior_inbound {
    union inbound any;
    mavlink_junior_wheels_t wheels;
    mavlink_junior_maneuver_t maneuver;
    mavlink_junior_memory_write_t memory_write;
    mavlink_junior_memory_read_t memory_read;
    mavlink_junior_contest_t contest;
};

static inline const union junior_inbound *junior_inbound_of(const union inbound *message)
{
    return (const union junior_inbound *)message;
}

/* driving.c: trimmed wheels. */
void driving_set(struct junior *junior, int16_t left, int16_t right);
void driving_run(struct junior *junior, uint16_t duration, bool guarded); /* guarded: the border stops them */
void driving_step(struct junior *junior);

/* sensing.c */
enum { FAILURE_EYE = FAILURE_SENSOR, FAILURE_FLOOR = FAILURE_EYE + 2, FAILURE_ARM = FAILURE_FLOOR + 2 }; /* left, right each */
void sensing_start(struct junior *junior);
void sensing_tick(struct junior *junior);
bool sensing_send(struct junior *junior);
uint8_t sensing_stimulus(const struct junior *junior);
uint8_t sensing_off_ring(const struct junior *junior); /* bit 0 left, bit 1 right */

/* maneuver.c, reflex.c */
bool maneuver_valid(const struct maneuver_plan *plan);
bool maneuver_read(struct maneuver_plan *plan, uint16_t period, uint16_t options, uint8_t count, const uint8_t *codes);
void maneuver_begin(struct junior *junior, const struct maneuver_plan *plan, bool reported, uint16_t sequence);
void maneuver_step(struct junior *junior);
void maneuver_end(struct junior *junior, uint8_t outcome, uint8_t reason);      /* by what the states decided */
void maneuver_conclude(struct junior *junior, uint8_t outcome);                 /* of itself: tells the states */
void maneuver_report(struct junior *junior);
void maneuver_wheels(struct junior *junior, uint8_t action);
bool reflex_begin(struct junior *junior);
void reflex_step(struct junior *junior);

/* memory.c: at the end of non-volatile memory. */
enum { MEMORY_SLOT_SIZE = 16, MEMORY_NONE = 0xFF };
void memory_load(struct junior *junior);
uint8_t memory_find(struct junior *junior, uint8_t previous, uint8_t current); /* slot, or MEMORY_NONE */
bool memory_plan(struct junior *junior, uint8_t slot, struct maneuver_plan *plan);
bool memory_ready(const struct junior *junior); /* nothing is being stored */
uint8_t memory_handle_write(struct junior *junior, const mavlink_junior_memory_write_t *request);
uint8_t memory_handle_read(struct junior *junior, const mavlink_junior_memory_read_t *request);
void memory_step(struct junior *junior);

/* contest.c */
void contest_start(struct junior *junior);
uint8_t contest_begin(struct junior *junior, uint16_t countdown); /* Reason */
void contest_step(struct junior *junior);
void contest_input(struct junior *junior);

#endif
