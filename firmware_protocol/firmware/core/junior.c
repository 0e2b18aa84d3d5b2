/* Power-on and the control period. */
#include "core.h"

static void count_boot(struct junior *robot)
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

void junior_power_on(struct junior *robot, void *board)
{
#if JUNIOR_SIGNING
    bool held = hal_start(board) != 0;

#endif
    memset(robot, 0, sizeof *robot);
    robot->board = board;
#if JUNIOR_CAN
    robot->can.fitted = hal_has_can(board);
#endif
    time_start(robot);
    params_load(robot);
    memory_load(robot);
    count_boot(robot);
#if JUNIOR_SIGNING
    signing_start(robot, held);
#endif
    robot->system = (uint8_t)params_get(robot, PARAM_SYS_ID);
    sensing_start(robot);
    contest_start(robot);
    stream_start(robot);
    wheels_output(robot);
}

static void store(struct junior *robot)
{
    nvm_step(robot);
#if JUNIOR_SIGNING
    signing_step(robot);
#endif
    memory_step(robot);
    if (robot->memory.job == JOB_NONE) {
        params_save(robot);
    }
}

static void restart(struct junior *robot)
{
    if (robot->reboot && time_due(robot, robot->reboot_at) && nvm_idle(robot)) {
        hal_reboot(robot->board);
    }
}

void junior_tick(struct junior *robot)
{
    time_tick(robot);
#if JUNIOR_SIGNING
    signing_tick(robot);
#endif
    failure_step(robot);
    sensing_tick(robot);
    maneuver_step(robot);
    wheels_step(robot);
    contest_step(robot);
    frame_receive(robot);
    contest_input(robot);
    states_watch(robot);
    wheels_output(robot);
    store(robot);
    maneuver_report(robot);
    stream_step(robot);
    params_list_step(robot);
    notice_step(robot);
    time_measure_load(robot);
    restart(robot);
}
