/* What the modules of the core say to each other. Targets include their role's header only. */
#ifndef ROBOT_CORE_H
#define ROBOT_CORE_H

#include "flash.h"
#include "hal.h"
#include "robot.h"
#include "role.h"

/* time.c */
void time_start(struct robot *robot);
void time_tick(struct robot *robot);
void time_measure_load(struct robot *robot);
bool time_due(const struct robot *robot, uint32_t deadline);

/* frame.c: bytes to messages. frame_receive calls protocol_handle for every good frame. */
void frame_receive(struct robot *robot);

/* send.c: messages to bytes. False: no room now, nothing was sent. */
bool send_frame(struct robot *robot, uint16_t id, uint8_t crc_extra, const void *payload, uint8_t length);
#define SEND(robot, NAME, payload) \
    send_frame((robot), MAVLINK_MSG_ID_##NAME, MAVLINK_MSG_ID_##NAME##_CRC, (payload), MAVLINK_MSG_ID_##NAME##_LEN)

#if FIRMWARE_CAN
/* can.c: the same over CAN. */
void can_receive(struct robot *robot);
bool can_take(struct robot *robot, const struct hal_frame *frame, struct can_message *message); /* true: it is complete */
enum { FRAME_DATA = 8 };
void can_send_single(struct robot *robot, uint8_t function, const void *data); /* FRAME_DATA bytes; there is room */
bool can_send(struct robot *robot, uint16_t id, uint8_t crc_extra, const void *payload, uint8_t length);
#endif

/* protocol.c, command.c, numbered.c: what a message asks for. */
void protocol_handle(struct robot *robot, struct sender from, bool direct, uint16_t id, const union inbound *message);
uint16_t protocol_number(float param); /* what a command names, or 65535, which names nothing */
void command_handle(struct robot *robot, struct sender from, bool direct, const mavlink_command_long_t *command);
void numbered_open(struct robot *robot, struct sender from, const mavlink_robot_session_t *request);
void numbered_handle(struct robot *robot, struct sender from, uint16_t id, const union inbound *message);
void numbered_finish(struct robot *robot, uint16_t id, uint16_t sequence, uint8_t reason);
void numbered_close(struct robot *robot); /* the session: somebody has armed who does not hold it */

/* states.c: one table of states x events. */
enum event {
    EVENT_ARM,
    EVENT_DISARM,
    EVENT_ESTOP,
    EVENT_SESSION,      /* a new host */
    EVENT_DRIVE,        /* wheels as the host says */
    EVENT_MANUAL,       /* MANUAL_CONTROL */
    EVENT_PERFORM,
    EVENT_DONE,         /* the wheels' time ran out, or what was performed ended */
    EVENT_CONTEST,      /* the countdown begins */
    EVENT_GO,           /* the countdown is over */
    EVENT_CONTEST_STOP, /* by command, or by CONTEST_MAX */
    EVENT_RELEASE,      /* the keeper is silent, or is another now */
    EVENTS
};
uint8_t states_fire(struct robot *robot, uint8_t event, uint8_t reason); /* Reason: NONE when it was done */
bool states_armed(const struct robot *robot);
void states_watch(struct robot *robot);

/* keeper.c */
void keeper_set(struct robot *robot, uint8_t by, struct sender from);
bool keeper_is(const struct robot *robot, struct sender from);
void keeper_frame(struct robot *robot, struct sender from); /* a believed frame of this sender */
void keeper_numbered(struct robot *robot);                  /* a numbered message of the open session */
void keeper_alive(struct robot *robot, uint16_t host);      /* ROBOT_ALIVE */

/* wheels.c */
void wheels_stop(struct robot *robot);
static inline void wheels_run(struct robot *robot, uint16_t duration) /* in DRIVING they go on as they are set, this long */
{
    robot->wheels.deadline = robot->time.now + duration; /* the caller goes on with wheels_step: no time at all is a stop */
}
void wheels_step(struct robot *robot);
void wheels_output(struct robot *robot);

/* failure.c: what drivers read and set, unless it is to fail */
#if FIRMWARE_FAILURES
uint8_t failure_inject(struct robot *robot, struct sender from, const mavlink_command_long_t *command); /* MAV_RESULT */
void failure_step(struct robot *robot);
uint16_t failure_read(struct robot *robot, uint8_t part, uint16_t reading, uint16_t before);
int16_t failure_effort(const struct robot *robot, uint8_t side);
bool failure_deaf(const struct robot *robot);
#else
#define failure_step(robot) ((void)(robot))
#define failure_read(robot, part, reading, before) (reading)
#define failure_effort(robot, side) ((robot)->wheels.effort[side])
#define failure_deaf(robot) false
#endif

/* params.c */
#define NO_PARAM 255U /* in place of an index: the role has none */
void params_load(struct robot *robot);
void params_save(struct robot *robot);
static inline int16_t params_get(const struct robot *robot, uint8_t index) /* whole: the value; else permille */
{
    return robot->params.integer[index];
}
void params_handle_read(struct robot *robot, const mavlink_param_request_read_t *request);
void params_handle_set(struct robot *robot, const mavlink_param_set_t *request);
void params_list_step(struct robot *robot);

/* nvm.c: bytes and records that survive power-off, whenever the power goes. */
enum {
    RECORD_BOOTS,
    RECORD_PARAMS,
    RECORD_SIZE = 14,
    NVM_ROLE_SIZE = 528, /* bytes at the end that are a role's own: as many for every role, so that a key stays where it is */
    NVM_ROLE_ADDRESS = HAL_NVM_SIZE - NVM_ROLE_SIZE,
};
enum record_state { RECORD_BLANK, RECORD_GOOD, RECORD_SPOILT };
bool nvm_idle(const struct robot *robot);
void nvm_begin(struct robot *robot, uint16_t address, uint8_t length); /* writes nvm.data; its last byte is the mark */
void nvm_step(struct robot *robot);
void nvm_flush(struct robot *robot);
uint8_t nvm_record_read(struct robot *robot, uint8_t index, uint16_t seed, uint8_t value[4]); /* record_state */
void nvm_record_write(struct robot *robot, uint8_t index, uint16_t seed, const uint8_t value[4]);

#if FIRMWARE_SIGNING
/* sha256.c: one hash at a time, byte by byte. */
struct sha256 {
    uint32_t state[8], block[16];
    uint16_t length;
};
void sha256_begin(struct sha256 *hash);
void sha256_add(struct sha256 *hash, uint8_t byte);
void sha256_end(struct sha256 *hash, uint8_t *first, uint8_t count);

/* signing.c. The two copies of the key, and below them the time, lie under what is the role's. */
enum {
    SIGNING_ADDRESS = NVM_ROLE_ADDRESS - 2 * SIGNING_SLOT_SIZE,
    RECORD_SIGNED = SIGNING_ADDRESS / RECORD_SIZE - 1,
};
void signing_start(struct robot *robot, bool held); /* held: the start input was on when the power came */
void signing_tick(struct robot *robot);
void signing_step(struct robot *robot);
void signing_setup(struct robot *robot, const mavlink_setup_signing_t *setup);
enum signing_verdict { SIGNING_BELIEVED, SIGNING_REFUSED, SIGNING_WRONG };
uint8_t signing_judge(struct robot *robot, const uint8_t *frame, uint8_t length); /* signing_verdict; counts what it refuses */
void signing_sign(struct robot *robot, const uint8_t *header, const uint8_t *payload, uint8_t length,
                  const uint8_t *checksum, uint8_t *signature);
bool signing_late(struct robot *robot);
#endif

/* stream.c, notice.c */
void stream_start(struct robot *robot);
void stream_step(struct robot *robot);
uint8_t stream_count(const struct robot *robot);
uint8_t stream_find(const struct robot *robot, uint32_t message); /* where it stands, or stream_count */
bool stream_is_role(const struct robot *robot, uint8_t stream);
uint8_t stream_set_interval(struct robot *robot, uint32_t message, int32_t interval); /* MAV_RESULT */
enum notice {
    NOTICE_WATCHDOG,
    NOTICE_ESTOP,
    NOTICE_BATTERY,
    NOTICE_DEFAULTS,
#if FIRMWARE_FAILURES
    NOTICE_FAILURE,
#endif
    NOTICES
};
void notice_raise(struct robot *robot, uint8_t notice);
void notice_step(struct robot *robot);

#endif
