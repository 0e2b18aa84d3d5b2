/* Power-on and the control period. */
#include "core/core.h"

static void count_boot(struct robot *robot)
{
    uint8_t bytes[4];

    if (nvm_record_read(robot, RECORD_BOOTS, 0xFFFF, bytes) == RECORD_GOOD) {
        robot->counters.boots = (uint16_t)(bytes[0] | (uint16_t)bytes[1] << 8);
    }
    robot->counters.boots++;
    bytes[0] = (uint8_t)robot->counters.boots;
    bytes[1] = (uint8_t)(robot->counters.boots >> 8);
    bytes[2] = 0;
    bytes[3] = 0;
    nvm_record_write(robot, RECORD_BOOTS, 0xFFFF, bytes);
    nvm_flush(robot);
}

void robot_power_on(struct robot *robot, void *board)
{
#if FIRMWARE_SIGNING
    bool held = hal_start(board) != 0;

#endif
#ifndef ROLE
    robot->role = hal_role(board);
#endif
    robot->board = board;
#if FIRMWARE_CAN
    robot->can.fitted = hal_has_can(board);
#endif
    time_start(robot);
    params_load(robot);
    ROLE_OF(robot, load)(robot);
    count_boot(robot);
#if FIRMWARE_SIGNING
    signing_start(robot, held);
#endif
    robot->system = (uint8_t)params_get(robot, ROLE_OF(robot, param_sys_id));
    ROLE_OF(robot, start)(robot);
    stream_start(robot);
    wheels_output(robot);
}

static void store(struct robot *robot)
{
    nvm_step(robot);
#if FIRMWARE_SIGNING
    signing_step(robot);
#endif
    if (ROLE_OF(robot, store)(robot)) {
        params_save(robot);
    }
}

static void restart(struct robot *robot)
{
    if (robot->reboot && time_due(robot, robot->reboot_at) && nvm_idle(robot)) {
        hal_reboot(robot->board);
    }
}

void robot_tick(struct robot *robot)
{
    time_tick(robot);
#if FIRMWARE_SIGNING
    signing_tick(robot);
#endif
    failure_step(robot);
    ROLE_OF(robot, act)(robot);
    robot->battery = failure_read(robot, FAILURE_BATTERY, hal_battery(robot->board), robot->battery);
    frame_receive(robot);
    ROLE_OF(robot, override)(robot);
    states_watch(robot);
    wheels_output(robot);
    store(robot);
    ROLE_OF(robot, report)(robot);
    stream_step(robot);
    params_list_step(robot);
    notice_step(robot);
    time_measure_load(robot);
    restart(robot);
}
