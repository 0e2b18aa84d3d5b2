/* What Junior brings to the core. */
#include "junior/modules.h"

const struct inbound_row junior_inbound[] HAL_FLASH = {ROLE_INBOUND_TABLE JUNIOR_INBOUND_TABLE(INBOUND_ROW)};
const struct param_row junior_params[] HAL_FLASH = {JUNIOR_PARAM_TABLE(PARAM_ROW)};
const struct stream_row junior_streams[] HAL_FLASH = {JUNIOR_STREAM_TABLE(STREAM_ROW)};
JUNIOR_INBOUND_TABLE(INBOUND_FITS)

#ifndef ROLE
ROLE_DEFINE(junior)
#endif

void junior_load(struct robot *robot)
{
    memory_load(junior_of(robot));
}

void junior_start(struct robot *robot)
{
    sensing_start(junior_of(robot));
    contest_start(junior_of(robot));
}

void junior_act(struct robot *robot)
{
    struct junior *junior = junior_of(robot);

    sensing_tick(junior);
    maneuver_step(junior);
    driving_step(junior);
    contest_step(junior);
}

void junior_override(struct robot *robot)
{
    contest_input(junior_of(robot));
}

bool junior_store(struct robot *robot)
{
    memory_step(junior_of(robot));
    return junior_of(robot)->memory.job == JOB_NONE;
}

void junior_report(struct robot *robot)
{
    maneuver_report(junior_of(robot));
}

void junior_interrupt(struct robot *robot, uint8_t event, uint8_t reason)
{
    bool replaced = event == EVENT_PERFORM || event == EVENT_DRIVE;

    if (junior_of(robot)->maneuver.phase != PHASE_IDLE) {
        maneuver_end(junior_of(robot), replaced ? JUNIOR_OUTCOME_REPLACED : JUNIOR_OUTCOME_STOPPED, reason);
    }
}

void junior_drive(struct robot *robot, int16_t left, int16_t right, uint16_t duration)
{
    driving_set(junior_of(robot), left, right);
    driving_run(junior_of(robot), duration, false);
}

uint8_t junior_request(struct robot *robot, uint8_t stream, bool direct, /* unreachable: stream_asked is 0 */
                       const mavlink_command_long_t *command)
{
    (void)robot;
    (void)stream;
    (void)command;
    (void)direct;
    return MAV_RESULT_UNSUPPORTED; /* unreachable: stream_asked is 0 */
}

bool junior_send(struct robot *robot, uint8_t stream)
{
    (void)stream; /* there is but one */
    return sensing_send(junior_of(robot));
}
