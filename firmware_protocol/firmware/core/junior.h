/* Junior's firmware: the state of one robot, and the two functions a target calls.
 *
 * The core allocates nothing and has no globals, so that one process can run as many robots as it has memory for.
 */
#ifndef JUNIOR_H
#define JUNIOR_H

#include <stdbool.h>
#include <stdint.h>

#include "tables.h"
#include "wire.h"

#define FIRMWARE_VERSION 0x00010000UL /* 0.1.0: major, minor, patch, type */

#define TICK_MS 5U     /* nominal control period */
#define MEMORY_SLOTS 32U /* default of MEM_SLOTS; on a 1 KiB EEPROM there is room for no more */
#define LEFT 0U
#define RIGHT 1U

#ifndef JUNIOR_CAN
#define JUNIOR_CAN 0 /* 1: the front end for CAN (can.c) is there, and used where hal_has_can says so */
#endif

#ifndef JUNIOR_FAILURES
#define JUNIOR_FAILURES 1 /* 0: failures on request (failure.c) are left out, and the command is answered as unknown */
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

#if JUNIOR_CAN
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

#if JUNIOR_SIGNING
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

/* --- sensing.c --------------------------------------------------------------------------------------------------- */

struct arm {
    uint32_t raw_since;     /* ms: the switch has read the same since */
    uint32_t pressed_since; /* ms */
    uint8_t raw;
};

struct sensing {
    uint16_t eye[2], floor[2], battery;
    uint16_t flags;        /* SensorFlag */
    uint8_t edges;         /* press edges of this tick: bit 0 left, bit 1 right */
    struct arm arm[2];
    int32_t encoder[2];    /* um, last reading */
    int16_t travel_um[2];  /* remainder of travel */
    int32_t travel_mm[2];
    int32_t ground;        /* um, last reading */
    int32_t ground_moved;  /* um, in this tick */
    uint32_t battery_good; /* ms: last time it was not low */
};

/* --- wheels.c ---------------------------------------------------------------------------------------------------- */

struct wheels {
    int16_t effort[2]; /* permille, trimmed */
    uint32_t deadline; /* ms, while DRIVING */
    bool guarded;      /* the border stops them */
};

/* --- maneuver.c, reflex.c ---------------------------------------------------------------------------------------- */

enum { MANEUVER_OPTIONS = 31 }; /* every bit of ManeuverOption */

struct maneuver_plan {
    uint16_t period; /* ms */
    uint8_t options; /* ManeuverOption */
    uint8_t count;
    uint8_t actions[MAX_ACTIONS];
};

enum maneuver_phase { PHASE_IDLE, PHASE_ACTING, PHASE_BACKING, PHASE_TURNING };

struct maneuver {
    struct maneuver_plan plan;
    uint8_t phase;
    uint8_t index;           /* action being performed */
    bool reported;           /* asked for by a host, that wants the result */
    bool changing;           /* stimulus differs from the first one */
    bool turn_left;          /* reflex: way to turn */
    uint32_t phase_end;      /* ms: end of the action, or of the part of the reflex */
    uint32_t changing_since; /* ms */
    int32_t pressed_um;      /* travel while pressed, this action */
    uint16_t press[2];       /* ms: present unbroken press, this action */
    bool result_pending;
    uint32_t result_due;     /* ms */
    mavlink_junior_maneuver_result_t result; /* filled as the maneuver goes */
};

/* --- params.c, nvm.c, memory.c ----------------------------------------------------------------------------------- */

struct params {
    float value[PARAM_COUNT];
    int16_t integer[PARAM_COUNT];           /* whole: the value; else permille of it */
    uint8_t unsaved[(PARAM_COUNT + 7) / 8]; /* bit set: differs from what is stored */
    uint8_t list_next;                      /* next parameter to send of a list; PARAM_COUNT: none */
};

struct nvm {
    uint16_t address;
#if JUNIOR_SIGNING
    uint8_t data[SIGNING_SLOT_SIZE];
#else
    uint8_t data[16];
#endif
    uint8_t length, position;
    bool busy;
};

enum memory_job { JOB_NONE, JOB_WRITE, JOB_ERASE_OLD, JOB_ERASE_ALL };

struct memory {
    uint8_t order[MEMORY_SLOTS + 1]; /* physical slots in use, by previous, then current stimulus */
    uint8_t used;                    /* how many; one more than MEM_SLOTS while one is being replaced */
    uint16_t checksum;
    bool checked;     /* the checksum is that of the present contents */
    uint8_t job;      /* memory_job */
    uint8_t slot;     /* being written or erased */
    uint8_t old;      /* slot to be erased afterwards, or 0xFF */
    bool asked;       /* the command is to be answered: its session is still open */
    uint16_t sequence; /* of the command */
};

/* --- contest.c --------------------------------------------------------------------------------------------------- */

struct contest {
    uint32_t begins;     /* ms: end of the countdown */
    uint8_t previous;    /* stimulus that the last maneuver answered */
    uint8_t start_input; /* last reading of the start module */
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

enum stream_id { STREAM_HEARTBEAT, STREAM_SYS_STATUS, STREAM_SENSORS, STREAM_STATUS, STREAM_VERSION, STREAMS };

struct streams {
    uint16_t interval[STREAMS]; /* ms; 0 off */
    uint32_t due[STREAMS];
    uint8_t requested;          /* bit per stream: send once, now */
};

struct notices {
    uint8_t pending; /* bit per enum notice */
    uint32_t next;   /* ms: earliest time of the next text */
    uint32_t battery_next;
};

#if JUNIOR_FAILURES
/* --- failure.c --------------------------------------------------------------------------------------------------- */

enum { FAILURE_EYE, FAILURE_FLOOR = 2, FAILURE_ARM = 4, FAILURE_BATTERY = 6, FAILURE_WHEEL, FAILURE_HOST = 9, FAILURE_PARTS };

struct failures {
    uint8_t type[FAILURE_PARTS]; /* FAILURE_TYPE; pairs are left, right */
    uint16_t noise;
};
#endif

struct junior {
    void *board;
    uint8_t system;   /* id on the network */
    uint8_t state;    /* State */
    bool reboot; /* asked for: nothing arms any more */
    uint32_t reboot_at;
    struct time time;
    struct frame frame;
#if JUNIOR_CAN
    struct can can;
#endif
#if JUNIOR_SIGNING
    struct signing signing;
#endif
    struct counters counters;
    struct sensing sensing;
    struct wheels wheels;
    struct maneuver maneuver;
    struct params params;
    struct nvm nvm;
    struct memory memory;
    struct contest contest;
    struct keeper keeper;
    struct session session;
    struct streams streams;
    struct notices notices;
#if JUNIOR_FAILURES
    struct failures failures;
#endif
};

/* Boots: reads non-volatile memory, counts the boot, comes up disarmed with stopped wheels. */
void junior_power_on(struct junior *robot, void *board);

/* One control period: sensors, received bytes, behaviour, wheels, messages. */
void junior_tick(struct junior *robot);

#endif
