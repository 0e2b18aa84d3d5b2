/* Parameters: REAL32 on the wire and in memory that survives power-off, integers for whoever uses them. */
#include "core/core.h"

#include <math.h>

enum { NAME = 16 };
#define NO_INDEX 0xFFFFU

static const struct param_row *row_of(const struct robot *robot, uint8_t index)
{
    return &ROLE_OF(robot, params)[index];
}

static uint8_t count_of(const struct robot *robot)
{
    return ROLE_OF(robot, param_count);
}

/* Not written is what is not allowed: NaN fails every comparison. */
static bool allowed(const struct robot *robot, uint8_t index, float value)
{
    const struct param_row *row = row_of(robot, index);

    if (!(value >= flash_float(&row->minimum) && value <= flash_float(&row->maximum))) {
        return false;
    }
    return !(flash_u8(&row->flags) & PARAM_FLAG_WHOLE) || (float)(int16_t)value == value;
}

static void take(struct robot *robot, uint8_t index, float value)
{
    robot->params.value[index] = value;
    robot->params.integer[index]
        = (int16_t)(int32_t)(flash_u8(&row_of(robot, index)->flags) & PARAM_FLAG_WHOLE ? value : value * 1000.0f + 0.5f);
}

/* The name is in a record's checksum: a parameter that moved in the table is not mistaken for another. */
static uint16_t seed_of(const struct robot *robot, uint8_t index)
{
    uint16_t crc = 0xFFFF;
    uint8_t i;

    for (i = 0; i < NAME; i++) {
        crc = wire_crc(crc, flash_u8(&row_of(robot, index)->name[i]));
    }
    return crc;
}

void params_load(struct robot *robot)
{
    uint8_t i, bytes[4];
    float value;

    robot->params.list_next = count_of(robot);
    for (i = 0; i < count_of(robot); i++) {
        take(robot, i, flash_float(&row_of(robot, i)->initial));
        if (flash_u8(&row_of(robot, i)->flags) & PARAM_FLAG_READ_ONLY) {
            continue;
        }
        switch (nvm_record_read(robot, (uint8_t)(RECORD_PARAMS + i), seed_of(robot, i), bytes)) {
        case RECORD_GOOD:
            memcpy(&value, bytes, sizeof value);
            if (allowed(robot, i, value)) {
                take(robot, i, value);
            }
            break;
        case RECORD_SPOILT:
            notice_raise(robot, NOTICE_DEFAULTS);
            break;
        default:
            break;
        }
    }
}

/* Stores one changed parameter, when nothing else is being stored. */
void params_save(struct robot *robot)
{
    uint8_t i, bytes[4];

    for (i = 0; i < count_of(robot); i++) {
        if (robot->params.unsaved[i / 8] == 0) {
            i |= 7;
            continue;
        }
        if (robot->params.unsaved[i / 8] & (1U << i % 8)) {
            if (!nvm_idle(robot)) {
                return;
            }
            robot->params.unsaved[i / 8] &= (uint8_t) ~(1U << i % 8);
            memcpy(bytes, &robot->params.value[i], sizeof bytes);
            nvm_record_write(robot, (uint8_t)(RECORD_PARAMS + i), seed_of(robot, i), bytes);
        }
    }
}

static uint8_t find(const struct robot *robot, const char name[NAME])
{
    uint8_t i, k;

    for (i = 0; i < count_of(robot); i++) {
        for (k = 0; k < NAME && (char)flash_u8(&row_of(robot, i)->name[k]) == name[k]; k++) {
            if (name[k] == 0) {
                return i;
            }
        }
        if (k == NAME) {
            return i; /* unreachable: no parameter has a name of 16 characters, MAVLink's longest, yet */
        }
    }
    return count_of(robot);
}

static bool send_value(struct robot *robot, uint8_t index)
{
    mavlink_param_value_t value;

    memset(&value, 0, sizeof value);
    flash_copy(value.param_id, row_of(robot, index)->name, NAME);
    value.param_value = robot->params.value[index];
    value.param_type = MAV_PARAM_TYPE_REAL32;
    value.param_count = count_of(robot);
    value.param_index = index;
    return SEND(robot, PARAM_VALUE, &value);
}

void params_handle_read(struct robot *robot, const mavlink_param_request_read_t *request)
{
    mavlink_param_value_t nothing;
    uint8_t index = count_of(robot);

    if (request->param_index < 0) {
        index = find(robot, request->param_id);
    } else if (request->param_index < count_of(robot)) {
        index = (uint8_t)request->param_index;
    }
    if (index < count_of(robot)) {
        send_value(robot, index);
        return;
    }
    memset(&nothing, 0, sizeof nothing);
    memcpy(nothing.param_id, request->param_id, NAME);
    nothing.param_value = NAN; /* for those who look at nothing else */
    nothing.param_type = MAV_PARAM_TYPE_REAL32;
    nothing.param_count = count_of(robot);
    nothing.param_index = NO_INDEX;
    SEND(robot, PARAM_VALUE, &nothing);
}

/* A node of a CAN bus has seven bits. */
static bool has_place(const struct robot *robot, uint8_t index, float value)
{
#if FIRMWARE_CAN
    return !(robot->can.fitted && index == ROLE_OF(robot, param_sys_id) && value > 127.0f);
#else
    (void)robot;
    (void)index;
    (void)value;
    return true;
#endif
}

/* What is not allowed changes nothing; the answer is the value in force. */
void params_handle_set(struct robot *robot, const mavlink_param_set_t *request)
{
    uint8_t index = find(robot, request->param_id);

    if (index == count_of(robot)) {
        return;
    }
    if (!(flash_u8(&row_of(robot, index)->flags) & PARAM_FLAG_READ_ONLY) && allowed(robot, index, request->param_value)
        && has_place(robot, index, request->param_value) && request->param_value != robot->params.value[index]) {
        take(robot, index, request->param_value);
        robot->params.unsaved[index / 8] |= (uint8_t)(1U << index % 8);
    }
    send_value(robot, index);
}

/* One a tick, so that a slow line has room for the rest. */
void params_list_step(struct robot *robot)
{
    if (robot->params.list_next < count_of(robot) && send_value(robot, robot->params.list_next)) {
        robot->params.list_next++;
    }
}
