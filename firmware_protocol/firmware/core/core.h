/* What the modules of the core say to each other. Targets include junior.h only. */
#ifndef JUNIOR_CORE_H
#define JUNIOR_CORE_H

#include "flash.h"
#include "hal.h"
#include "junior.h"

/* time.c */
void time_start(struct junior *robot);
void time_tick(struct junior *robot);
void time_measure_load(struct junior *robot);
bool time_due(const struct junior *robot, uint32_t deadline);

/* frame.c: bytes to messages. frame_receive calls protocol_handle for every good frame. */
void frame_receive(struct junior *robot);

/* send.c: messages to bytes. False: no room now, nothing was sent. */
bool send_frame(struct junior *robot, uint16_t id, uint8_t crc_extra, const void *payload, uint8_t length);
#define SEND(robot, NAME, payload) \
    send_frame((robot), MAVLINK_MSG_ID_##NAME, MAVLINK_MSG_ID_##NAME##_CRC, (payload), MAVLINK_MSG_ID_##NAME##_LEN)

#if JUNIOR_CAN
/* can.c: the same over CAN. */
struct can_message {
    uint16_t id;
    bool direct; /* to this robot, not to all */
    union inbound payload;
};
void can_receive(struct junior *robot);
bool can_take(struct junior *robot, const struct hal_frame *frame, struct can_message *message); /* true: it is complete */
bool can_send(struct junior *robot, uint16_t id, uint8_t crc_extra, const void *payload, uint8_t length);
#endif

/* protocol.c, command.c, numbered.c: what a message asks for. */
void protocol_handle(struct junior *robot, struct sender from, bool direct, uint16_t id, const union inbound *message);
uint16_t protocol_number(float param); /* what a command names, or 65535, which names nothing */
void command_handle(struct junior *robot, struct sender from, bool direct, const mavlink_command_long_t *command);
void numbered_handle(struct junior *robot, struct sender from, uint16_t id, const union inbound *message);
void numbered_finish(struct junior *robot, uint16_t id, uint16_t sequence, uint8_t reason);
void numbered_close(struct junior *robot); /* the session: somebody has armed who does not hold it */
enum { ANSWER_PENDING = 0xFF };

/* states.c: one table of states x events. */
enum event {
    EVENT_ARM,
    EVENT_DISARM,
    EVENT_ESTOP,
    EVENT_SESSION,      /* a new host */
    EVENT_DRIVE,        /* JUNIOR_WHEELS */
    EVENT_MANUAL,       /* MANUAL_CONTROL */
    EVENT_PERFORM,
    EVENT_DONE,         /* the wheels' time ran out, or the maneuver ended */
    EVENT_CONTEST,      /* the countdown begins */
    EVENT_GO,           /* the countdown is over */
    EVENT_CONTEST_STOP, /* by command, or by CONTEST_MAX */
    EVENT_RELEASE,      /* the keeper is silent, or is another now */
    EVENTS
};
uint8_t states_fire(struct junior *robot, uint8_t event, uint8_t reason); /* Reason: NONE when it was done */
bool states_armed(const struct junior *robot);
void states_watch(struct junior *robot);

/* keeper.c */
void keeper_set(struct junior *robot, uint8_t by, struct sender from);
bool keeper_is(const struct junior *robot, struct sender from);
void keeper_frame(struct junior *robot, struct sender from); /* a believed frame of this sender */
void keeper_numbered(struct junior *robot);                  /* a numbered message of the open session */
void keeper_alive(struct junior *robot, uint16_t host);      /* ROBOT_ALIVE */

/* wheels.c */
void wheels_set(struct junior *robot, int16_t left, int16_t right);
void wheels_stop(struct junior *robot);
void wheels_drive(struct junior *robot, int16_t left, int16_t right, uint16_t duration);
void wheels_run(struct junior *robot, uint16_t duration, bool guarded); /* guarded: the border stops them */
void wheels_step(struct junior *robot);
void wheels_output(struct junior *robot);

/* sensing.c */
void sensing_start(struct junior *robot);
void sensing_tick(struct junior *robot);
uint8_t sensing_stimulus(const struct junior *robot);
uint8_t sensing_off_ring(const struct junior *robot); /* bit 0 left, bit 1 right */

/* maneuver.c, reflex.c */
bool maneuver_valid(const struct maneuver_plan *plan);
bool maneuver_read(struct maneuver_plan *plan, uint16_t period, uint16_t options, uint8_t count, const uint8_t *codes);
void maneuver_begin(struct junior *robot, const struct maneuver_plan *plan, bool reported, uint16_t sequence);
void maneuver_step(struct junior *robot);
void maneuver_end(struct junior *robot, uint8_t outcome, uint8_t reason);      /* by what the states decided */
void maneuver_conclude(struct junior *robot, uint8_t outcome);                 /* of itself: tells the states */
void maneuver_report(struct junior *robot);
void maneuver_wheels(struct junior *robot, uint8_t action);
bool reflex_begin(struct junior *robot);
void reflex_step(struct junior *robot);

/* failure.c: what drivers read and set, unless it is to fail */
#if JUNIOR_FAILURES
uint8_t failure_inject(struct junior *robot, struct sender from, const mavlink_command_long_t *command); /* MAV_RESULT */
void failure_step(struct junior *robot);
uint16_t failure_read(struct junior *robot, uint8_t part, uint16_t reading, uint16_t before);
int16_t failure_effort(const struct junior *robot, uint8_t side);
bool failure_deaf(const struct junior *robot);
#else
#define failure_step(robot) ((void)(robot))
#define failure_read(robot, part, reading, before) (reading)
#define failure_effort(robot, side) ((robot)->wheels.effort[side])
#define failure_deaf(robot) false
#endif

/* contest.c */
void contest_start(struct junior *robot);
uint8_t contest_begin(struct junior *robot, uint16_t countdown); /* Reason */
void contest_step(struct junior *robot);
void contest_input(struct junior *robot);

/* params.c */
void params_load(struct junior *robot);
void params_save(struct junior *robot);
static inline int16_t params_get(const struct junior *robot, uint8_t index) /* whole: the value; else permille */
{
    return robot->params.integer[index];
}
void params_handle_read(struct junior *robot, const mavlink_param_request_read_t *request);
void params_handle_set(struct junior *robot, const mavlink_param_set_t *request);
void params_list_step(struct junior *robot);

/* nvm.c: bytes and records that survive power-off, whenever the power goes. */
enum { RECORD_BOOTS, RECORD_PARAMS, RECORD_SIZE = 14 };
enum record_state { RECORD_BLANK, RECORD_GOOD, RECORD_SPOILT };
bool nvm_idle(const struct junior *robot);
void nvm_begin(struct junior *robot, uint16_t address, uint8_t length); /* writes nvm.data; its last byte is the mark */
void nvm_step(struct junior *robot);
void nvm_flush(struct junior *robot);
uint8_t nvm_record_read(struct junior *robot, uint8_t index, uint16_t seed, uint8_t value[4]); /* record_state */
void nvm_record_write(struct junior *robot, uint8_t index, uint16_t seed, const uint8_t value[4]);

#if JUNIOR_SIGNING
/* sha256.c: one hash at a time, byte by byte. */
struct sha256 {
    uint32_t state[8], block[16];
    uint16_t length;
};
void sha256_begin(struct sha256 *hash);
void sha256_add(struct sha256 *hash, uint8_t byte);
void sha256_end(struct sha256 *hash, uint8_t *first, uint8_t count);

/* signing.c. The two copies of the key, and below them the time, lie under the memory. */
enum {
    SIGNING_ADDRESS = HAL_NVM_SIZE - (MEMORY_SLOTS + 1) * 16 - 2 * SIGNING_SLOT_SIZE,
    RECORD_SIGNED = SIGNING_ADDRESS / RECORD_SIZE - 1,
};
void signing_start(struct junior *robot, bool held); /* held: the start input was on when the power came */
void signing_tick(struct junior *robot);
void signing_step(struct junior *robot);
void signing_setup(struct junior *robot, const mavlink_setup_signing_t *setup);
enum signing_verdict { SIGNING_BELIEVED, SIGNING_REFUSED, SIGNING_WRONG };
uint8_t signing_judge(struct junior *robot, const uint8_t *frame, uint8_t length); /* signing_verdict; counts what it refuses */
void signing_sign(struct junior *robot, const uint8_t *header, const uint8_t *payload, uint8_t length,
                  const uint8_t *checksum, uint8_t *signature);
bool signing_late(struct junior *robot);
#endif

/* memory.c */
enum {
    MEMORY_SLOT_SIZE = 16,
    MEMORY_ADDRESS = HAL_NVM_SIZE - (MEMORY_SLOTS + 1) * MEMORY_SLOT_SIZE,
    MEMORY_NONE = 0xFF,
};
void memory_load(struct junior *robot);
uint8_t memory_find(struct junior *robot, uint8_t previous, uint8_t current); /* slot, or MEMORY_NONE */
bool memory_plan(struct junior *robot, uint8_t slot, struct maneuver_plan *plan);
bool memory_ready(const struct junior *robot); /* nothing is being stored */
uint8_t memory_handle_write(struct junior *robot, const mavlink_junior_memory_write_t *request);
uint8_t memory_handle_read(struct junior *robot, const mavlink_junior_memory_read_t *request);
void memory_step(struct junior *robot);

/* stream.c, notice.c */
void stream_start(struct junior *robot);
void stream_step(struct junior *robot);
uint8_t stream_find(uint32_t message); /* stream_id, or STREAMS */
uint8_t stream_set_interval(struct junior *robot, uint32_t message, int32_t interval); /* MAV_RESULT */
enum notice {
    NOTICE_WATCHDOG,
    NOTICE_ESTOP,
    NOTICE_BATTERY,
    NOTICE_DEFAULTS,
#if JUNIOR_FAILURES
    NOTICE_FAILURE,
#endif
    NOTICES
};
void notice_raise(struct junior *robot, uint8_t notice);
void notice_step(struct junior *robot);

#endif
