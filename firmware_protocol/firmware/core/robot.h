/* What any robot has, whatever its role: its state, and the two functions a target calls.
 *
 * A role (role.h) has a struct of its own that begins with this one; a target keeps that. Nothing is allocated and there
 * are no globals, so that one process can run as many robots as it has memory for.
 */
#ifndef ROBOT_H
#define ROBOT_H

#include <stdbool.h>
#include <stdint.h>

#include "roles.h"
#include "tables.h"
#include "wire.h"

#define FIRMWARE_VERSION 0x00010000UL /* 0.1.0: major, minor, patch, type */

#define TICK_MS 5U     /* nominal control period */
#define LEFT 0U
#define RIGHT 1U

/* ROLE is the name of the only role in a build for a micro-controller. Where it is not defined, there are several. */
#define ROLE_PASTE(role, member) role##_##member
#define ROLE_JOIN(role, member) ROLE_PASTE(role, member)
#ifdef ROLE
#define ROLE_MOST(member) ROLE_JOIN(ROLE, member)
#else
#define ROLE_MOST(member) most_##member
#endif

#ifndef FIRMWARE_CAN
#define FIRMWARE_CAN 0 /* 1: the front end for CAN (can.c) is there, and used where hal_has_can says so */
#endif

#ifndef FIRMWARE_SYS_ID
#define FIRMWARE_SYS_ID 1.0f /* default of SYS_ID, of a robot that has stored none */
#endif

#ifndef FIRMWARE_FAILURES
#define FIRMWARE_FAILURES 1 /* 0: failures on request (failure.c) are left out, and the command is answered as unknown */
#endif

enum { HISTORY = 8, FORMER = 4, SENDERS = 4, FRAME_SIZE = 10 + WIRE_LARGEST_INBOUND + 2 + 13 };

/* --- time.c ------------------------------------------------------------------------------------------------------ */

struct time {
    uint64_t power_on; /* board's clock when we booted, us */
    uint64_t micros;   /* since boot */
    uint32_t now;      /* since boot, ms, wraps after 49 days; compare with time_due */
    uint16_t carry;    /* us of `micros` not yet in `now` */
    uint16_t elapsed;  /* since the tick before, ms */
    uint16_t load;     /* share of the last control period used, permille */
};

/* --- frame.c, send.c --------------------------------------------------------------------------------------------- */

struct sender {
    uint8_t system;
    uint8_t component;
};

struct frame {
    uint8_t bytes[FRAME_SIZE];
    uint8_t used;
    uint8_t need; /* bytes wanted before the next look */
    uint32_t heard;
    struct {
        struct sender sender;
        uint8_t next; /* frame sequence expected */
        bool known;
    } senders[SENDERS];
    uint8_t newest; /* sender replaced last */
    uint8_t sequence_out;
};

#if FIRMWARE_CAN
/* --- can.c ------------------------------------------------------------------------------------------------------- */

enum { CAN_TRANSFER_SIZE = 3 + WIRE_LARGEST_INBOUND + 2 };

struct can_transfer {
    uint8_t data[CAN_TRANSFER_SIZE];
    uint8_t size;   /* bytes that it will have; 0: none is under way */
    uint8_t used;   /* bytes that have come */
    uint8_t number; /* of the transfer */
    uint8_t head;   /* byte 0 of the last part */
    uint8_t count;  /* bytes of the last part */
    uint8_t next;   /* number expected next */
    bool known;     /* `next` is */
    uint32_t heard; /* ms: the last part */
};

struct can {
    bool fitted;
    uint8_t number_out;
    struct can_transfer in[2]; /* to all, to this robot */
};
#endif

#if FIRMWARE_SIGNING
/* --- signing.c --------------------------------------------------------------------------------------------------- */

enum { SIGNED_STREAMS = 4, SIGNING_KEY_SIZE = 32, SIGNING_SLOT_SIZE = SIGNING_KEY_SIZE + 3 };
enum signing_job { SIGNING_IDLE, SIGNING_FIRST_COPY, SIGNING_SECOND_COPY };

struct stamp { /* 48 bits, 10 us since 2015 */
    uint32_t high; /* 0.66 s */
    uint16_t low;
};

struct signed_stream {
    struct stamp last; /* of the last frame believed */
    uint8_t sender[2]; /* system, component */
    uint8_t link;
};

struct signing {
    struct stamp now;
    struct stamp floor; /* what begins a stream must be signed later */
    uint32_t durable;   /* stored time, as `high`: later than any that was used */
    uint32_t pending;   /* the same while it is being written */
    struct signed_stream streams[SIGNED_STREAMS];
    uint8_t used;
    bool on;      /* there is a key */
    uint8_t slot; /* copy of the key that is read */
    uint8_t job;  /* signing_job */
    uint16_t not_signed, bad, replayed; /* frames refused */
};
#endif

struct counters {
    uint32_t good, bad_checksum, unknown, lost;
    uint32_t maneuvers;
    uint16_t boots;
};

/* --- wheels.c ---------------------------------------------------------------------------------------------------- */

struct wheels {
    int16_t effort[2]; /* permille, trimmed */
    uint32_t deadline; /* ms, while DRIVING */
};

/* --- params.c, nvm.c --------------------------------------------------------------------------------------------- */

enum { PARAMS_MOST = ROLE_MOST(param_count) };

struct params {
    float value[PARAMS_MOST];
    int16_t integer[PARAMS_MOST];           /* whole: the value; else permille of it, beyond 32.767 as uint16_t */
    uint8_t unsaved[(PARAMS_MOST + 7) / 8]; /* bit set: differs from what is stored */
    uint8_t list_next;                      /* next parameter to send of a list; beyond the last: none */
};

enum { NVM_LONGEST = 16 }; /* bytes that a role can write at once */

struct nvm {
    uint16_t address;
#if FIRMWARE_SIGNING
    uint8_t data[SIGNING_SLOT_SIZE];
#else
    uint8_t data[NVM_LONGEST];
#endif
    uint8_t length, position;
    bool busy;
};

/* --- keeper.c ---------------------------------------------------------------------------------------------------- */

enum keeper_by { KEEPER_NONE, KEEPER_SESSION, KEEPER_SENDER };

struct keeper {
    uint8_t by;           /* keeper_by: what is heard of it */
    struct sender sender; /* who armed */
    uint32_t heard;       /* ms */
};

/* --- numbered.c, protocol.c, stream.c ---------------------------------------------------------------------------- */

struct answer {
    uint16_t sequence;
    uint8_t message; /* low byte of the id */
    uint8_t reason;  /* 0 accepted; ANSWER_PENDING not yet known */
};

struct session {
    uint16_t id;
    uint16_t host;       /* number of the program that opened it; never 0 */
    struct sender owner; /* who spoke in it last: answers go there */
    uint16_t last; /* highest sequence taken */
    bool open;
    uint8_t answers_used, answers_next;
    struct answer answers[HISTORY];
    struct {
        uint16_t id, last;
    } former[FORMER]; /* sessions before this one */
    uint8_t former_next;
};

/* The role's streams come between SYS_STATUS and ROBOT_STATUS. */
enum { STREAM_HEARTBEAT, STREAM_SYS_STATUS, STREAM_ROLE, STREAMS_OWN = 4, STREAMS_MOST = STREAMS_OWN + ROLE_MOST(stream_count) };

struct streams {
    uint16_t interval[STREAMS_MOST]; /* ms; 0 off */
    uint32_t due[STREAMS_MOST];
    uint8_t requested;               /* bit per stream: send once, now */
};

struct notices {
    uint8_t pending; /* bit per enum notice */
    uint32_t next;   /* ms: earliest time of the next text */
    uint32_t battery_next;
    uint32_t battery_good; /* ms: last time it was not low */
};

/* --- failure.c --------------------------------------------------------------------------------------------------- */

enum {
    FAILURE_BATTERY,
    FAILURE_WHEEL, /* left, right */
    FAILURE_HOST = FAILURE_WHEEL + 2,
    FAILURE_SENSOR, /* the role's, in its order */
    FAILURE_PARTS = FAILURE_SENSOR + ROLE_MOST(sensor_count)
};

#if FIRMWARE_FAILURES
struct failures {
    uint8_t type[FAILURE_PARTS]; /* FAILURE_TYPE */
    uint16_t noise;
};
#endif

struct robot {
#ifndef ROLE
    const struct role *role;
#endif
    void *board;
    uint8_t system;   /* id on the network */
    uint8_t state;    /* State */
    bool reboot; /* asked for: nothing arms any more */
    uint16_t battery; /* mV */
    uint32_t reboot_at;
    struct time time;
    struct frame frame;
#if FIRMWARE_CAN
    struct can can;
#endif
#if FIRMWARE_SIGNING
    struct signing signing;
#endif
    struct counters counters;
    struct wheels wheels;
    struct params params;
    struct nvm nvm;
    struct keeper keeper;
    struct session session;
    struct streams streams;
    struct notices notices;
#if FIRMWARE_FAILURES
    struct failures failures;
#endif
};

/* Boots: reads non-volatile memory, counts the boot, comes up disarmed with stopped wheels. `robot` is the head of its role's
 * struct; all of that is zero, as memory is when a program begins. */
void robot_power_on(struct robot *robot, void *board);

/* One control period: sensors, received bytes, behaviour, wheels, messages. */
void robot_tick(struct robot *robot);

#endif
