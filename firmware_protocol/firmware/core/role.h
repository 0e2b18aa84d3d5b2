/* What a role brings to the core: numbers, tables and functions.
 *
 * A role's things are called by its name: the role `junior` has junior_act, junior_inbound and so on. In a build for one role
 * (ROLE) they are used by these names, at no cost. Where there are several, each robot has its `struct role`, which hal_role
 * chooses at power-on. ROLE_OF(robot, what) is either.
 */
#ifndef ROBOT_ROLE_H
#define ROBOT_ROLE_H

#include "hal.h"
#include "robot.h"

/* --- tables ------------------------------------------------------------------------------------------------------ */

struct inbound_row { /* a message that a robot understands */
    uint16_t id;
    uint8_t length, crc_extra, system_at, component_at;
};

struct param_row {
    char name[16];
    float initial, minimum, maximum;
    uint8_t flags;
};

struct stream_row {
    uint16_t message, interval; /* ms; 0: on request only */
};

struct can_row { /* a message over CAN */
    uint16_t id;
    uint8_t length, crc_extra, cut_at, cut, inbound;
};

/* Rows of the generated tables; a role's table is that of any robot, and what the role adds. */
#define INBOUND_ROW(name, id, base, length, crc_extra, system_at, component_at) {id, length, crc_extra, system_at, component_at},
#define PARAM_ROW(name, initial, minimum, maximum, flags) {#name, initial, minimum, maximum, flags},
#define STREAM_ROW(name, interval) {MAVLINK_MSG_ID_##name, interval},
#define CAN_ROW(name, id, length, crc_extra, cut_at, cut, inbound) {id, length, crc_extra, cut_at, cut, inbound},
#if FIRMWARE_SIGNING
#define ROLE_INBOUND_TABLE INBOUND_TABLE(INBOUND_ROW) SIGNING_TABLE(INBOUND_ROW)
#else
#define ROLE_INBOUND_TABLE INBOUND_TABLE(INBOUND_ROW)
#endif

/* Every message of a table fits into the buffer. */
#define INBOUND_FITS(name, id, base, length, crc_extra, system_at, component_at) \
    typedef char fits_##name[(length) <= WIRE_LARGEST_INBOUND && (id) <= 0xFFFFL ? 1 : -1];

/* --- what a function is told, and says ---------------------------------------------------------------------------- */

enum { /* besides the values of Reason, what is said to a numbered message */
    ANSWER_GIVEN = 0xFE,   /* done; what the role has sent is the answer */
    ANSWER_PENDING = 0xFF, /* the role says numbered_finish when it is done */
};

struct can_message {
    uint16_t id;
    bool direct; /* to this robot, not to all */
    union inbound payload;
};

enum single_frames { SINGLE_NOT, SINGLE_SENT, SINGLE_NO_ROOM };

/* --- the role ---------------------------------------------------------------------------------------------------- */

/* Numbers: those of roles.h. */
#define ROLE_FACTS(F, role) \
    F(role, product) F(role, inbound_count) F(role, unnumbered_count) F(role, can_count) \
    F(role, stream_count) F(role, stream_asked) F(role, sensor_count) F(role, param_count) F(role, param_sys_id) F(role, param_watchdog) \
    F(role, param_batt_low) F(role, param_fail_enable)

#if FIRMWARE_CAN
#define ROLE_CAN_TABLES(T, role) T(role, struct can_row, can)
#define ROLE_CAN_FUNCTIONS(F, role) \
    /* A message that leaves as single frames: sends them. */ \
    F(role, uint8_t, single_out, (struct robot *robot, uint16_t id, const void *payload)) \
    /* A single frame of a function of the role's: makes it the message that it stands for. False: it is none. */ \
    F(role, bool, single_in, (struct robot *robot, uint8_t function, const struct hal_frame *frame, uint8_t node, \
                              struct can_message *message))
#else
#define ROLE_CAN_TABLES(T, role)
#define ROLE_CAN_FUNCTIONS(F, role)
#endif

/* Tables, in flash (HAL_FLASH). */
#define ROLE_TABLES(T, role) \
    T(role, struct inbound_row, inbound) T(role, struct param_row, params) T(role, struct stream_row, streams) \
    ROLE_CAN_TABLES(T, role)

#define ROLE_FUNCTIONS(F, role) \
    /* Power-on: takes up what the role has stored; parameters are known. Then, when the boot is counted, begins. */ \
    F(role, void, load, (struct robot *robot)) \
    F(role, void, start, (struct robot *robot)) \
    /* A control period, before bytes are read: sensors, and what follows from them. Calls wheels_step. */ \
    F(role, void, act, (struct robot *robot)) \
    /* After that: buttons and the like, which override what was received. */ \
    F(role, void, override, (struct robot *robot)) \
    /* Goes on with what is being stored. True: nothing is, parameters may be. */ \
    F(role, bool, store, (struct robot *robot)) \
    /* Sends results that are due, before any stream. */ \
    F(role, void, report, (struct robot *robot)) \
    /* What goes on ends by an event of states.c: another takes its place, or the state changes. */ \
    F(role, void, interrupt, (struct robot *robot, uint8_t event, uint8_t reason)) \
    /* The wheels are to turn like that, in permille, for so many ms: MANUAL_CONTROL. The robot is DRIVING. */ \
    F(role, void, drive, (struct robot *robot, int16_t left, int16_t right, uint16_t duration)) \
    /* A message of the role's: is it done when it is said to all robots? */ \
    F(role, bool, for_all, (uint16_t id, const union inbound *message)) \
    /* A message of the role's: takes it. False: it is a numbered one. Called if the role has others (unnumbered_count). */ \
    F(role, bool, hear, (struct robot *robot, uint16_t id, const union inbound *message)) \
    /* A numbered message: may it be begun? False: it is dropped, and the host says it again. */ \
    F(role, bool, ready, (struct robot *robot, uint16_t id)) \
    /* Does it, once. Reason, ANSWER_GIVEN or ANSWER_PENDING. */ \
    F(role, uint8_t, perform, (struct robot *robot, uint16_t id, const union inbound *message)) \
    /* The same message again, which had this answer: gives again what can be had without moving. Reason or ANSWER_GIVEN. */ \
    F(role, uint8_t, repeat, (struct robot *robot, uint16_t id, const union inbound *message, uint8_t reason)) \
    /* ROBOT_RESULT_ACK has named a result. */ \
    F(role, void, acknowledged, (struct robot *robot, uint16_t session, uint16_t sequence)) \
    /* The session is over: nobody waits for answers and results any more. */ \
    F(role, void, forget, (struct robot *robot)) \
    /* One of the role's streams is asked for once, of this robot or of all. MAV_RESULT; where that is accepted, `send` is \
     * called until it says true. Of all, there is no other answer. Called if the role is asked so (stream_asked). */ \
    F(role, uint8_t, request, (struct robot *robot, uint8_t stream, bool direct, const mavlink_command_long_t *command)) \
    /* Sends one of the role's streams. False: not now, it is tried again in the next period. */ \
    F(role, bool, send, (struct robot *robot, uint8_t stream)) \
    ROLE_CAN_FUNCTIONS(F, role)

#define ROLE_FACT_MEMBER(role, member) uint8_t member;
#define ROLE_TABLE_MEMBER(role, row, member) const row *member;
#define ROLE_FUNCTION_MEMBER(role, result, member, arguments) result(*member) arguments;
struct role {
    ROLE_FACTS(ROLE_FACT_MEMBER, )
    ROLE_TABLES(ROLE_TABLE_MEMBER, )
    ROLE_FUNCTIONS(ROLE_FUNCTION_MEMBER, )
};

/* ROLE_DECLARE(junior): what a role's header says. ROLE_DEFINE(junior): its `struct role`, junior_role. */
#define ROLE_TABLE_DECLARED(role, row, member) extern const row role##_##member[];
#define ROLE_FUNCTION_DECLARED(role, result, member, arguments) result role##_##member arguments;
#define ROLE_DECLARE(name) \
    ROLE_TABLES(ROLE_TABLE_DECLARED, name) ROLE_FUNCTIONS(ROLE_FUNCTION_DECLARED, name) extern const struct role name##_role;
#define ROLE_FACT_VALUE(role, member) role##_##member,
#define ROLE_TABLE_VALUE(role, row, member) role##_##member,
#define ROLE_FUNCTION_VALUE(role, result, member, arguments) role##_##member,
#define ROLE_DEFINE(name) \
    const struct role name##_role \
        = {ROLE_FACTS(ROLE_FACT_VALUE, name) ROLE_TABLES(ROLE_TABLE_VALUE, name) ROLE_FUNCTIONS(ROLE_FUNCTION_VALUE, name)};

#ifdef ROLE
#define ROLE_DECLARE_ONE(name) ROLE_DECLARE(name)
ROLE_DECLARE_ONE(ROLE)
#define ROLE_OF(robot, member) ((void)(robot), ROLE_JOIN(ROLE, member))
#else
#define ROLE_OF(robot, member) ((robot)->role->member)
const struct role *hal_role(void *board); /* which role the board has; asked once, at power-on */
#endif

#endif
