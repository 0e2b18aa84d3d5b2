/* The messages, as mavgen made them from dialect/junior.xml: structures, ids, lengths, checksum seeds and enumerations.
 *
 * On a little-endian machine a structure is the payload. Framing is our own (frame.c, send.c): it rejects a header at
 * once, rescans what it rejected, and needs a buffer for the longest frame that a robot understands, not for any frame.
 */
#ifndef ROBOT_WIRE_H
#define ROBOT_WIRE_H

#define MAVLINK_COMM_NUM_BUFFERS 1
#define MAVLINK_NO_SIGN_PACKET
#define MAVLINK_NO_SIGNATURE_CHECK
#include "dialect/junior/mavlink.h"

#include "tables.h"

#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "a message's structure is its payload on little-endian machines only"
#endif

#ifndef FIRMWARE_SIGNING
#define FIRMWARE_SIGNING 0 /* 1: MAVLink 2 signing (signing.c) is there, and used once a key was given */
#endif

struct numbered { /* every numbered message begins with this */
    uint16_t session, sequence;
};

/* What a robot understands: any robot's messages; a role has more of them, and says what is in `bytes` then. */
union inbound {
    struct numbered numbered;
    mavlink_heartbeat_t heartbeat;
    mavlink_ping_t ping;
    mavlink_param_request_read_t param_request_read;
    mavlink_param_request_list_t param_request_list;
    mavlink_param_set_t param_set;
    mavlink_mission_request_list_t mission_request_list;
    mavlink_manual_control_t manual_control;
    mavlink_command_long_t command_long;
    mavlink_timesync_t timesync;
    mavlink_robot_session_t session;
    mavlink_robot_result_ack_t result_ack;
    mavlink_robot_alive_t alive;
#if FIRMWARE_SIGNING
    mavlink_setup_signing_t setup_signing;
#define WIRE_LARGEST_INBOUND MAVLINK_MSG_ID_SETUP_SIGNING_LEN
#else
#define WIRE_LARGEST_INBOUND MAVLINK_MSG_ID_COMMAND_LONG_LEN
#endif
    uint8_t bytes[WIRE_LARGEST_INBOUND]; /* the longest; role.h checks that */
};

#define WIRE_OWN_COMPONENT MAV_COMP_ID_AUTOPILOT1

/* CRC-16/MCRF4XX, one byte further. */
static inline uint16_t wire_crc(uint16_t crc, uint8_t byte)
{
    uint8_t mixed = (uint8_t)(byte ^ (uint8_t)crc);
    mixed = (uint8_t)(mixed ^ (uint8_t)(mixed << 4));
    return (uint16_t)((crc >> 8) ^ ((uint16_t)mixed << 8) ^ ((uint16_t)mixed << 3) ^ (mixed >> 4));
}

#endif
