/* The keeper: who armed the robot, and must be heard so that it goes on moving (states_watch).
 *
 * A host that armed the robot and said which number its session has (param3 of the command) keeps it by numbered messages
 * of that session and by ROBOT_ALIVE. Who armed it without that, as a ground station does, has closed the session and keeps
 * it by any frame of its own; on CAN, where a frame has no sender, by any from the host's side. Nobody else keeps it: on a
 * MAVLink network every ground station is system 255.
 */
#include "core/core.h"

static void heard(struct robot *robot)
{
    if (!failure_deaf(robot)) {
        robot->keeper.heard = robot->time.now;
    }
}

bool keeper_is(const struct robot *robot, struct sender from)
{
    return robot->keeper.by != KEEPER_NONE && robot->keeper.sender.system == from.system
           && robot->keeper.sender.component == from.component;
}

/* What another has set in motion stops: the new keeper has not asked for it. */
void keeper_set(struct robot *robot, uint8_t by, struct sender from)
{
    if (robot->keeper.by != by || !keeper_is(robot, from)) {
        states_fire(robot, EVENT_RELEASE, ROBOT_REASON_BY_COMMAND);
    }
    if (by == KEEPER_SENDER) {
        numbered_close(robot);
    }
    robot->keeper.by = by;
    robot->keeper.sender = from;
    robot->keeper.heard = robot->time.now;
}

void keeper_frame(struct robot *robot, struct sender from)
{
    if (robot->keeper.by == KEEPER_SENDER && keeper_is(robot, from)) {
        heard(robot);
    }
}

void keeper_numbered(struct robot *robot)
{
    if (robot->keeper.by == KEEPER_SESSION) {
        heard(robot);
    }
}

void keeper_alive(struct robot *robot, uint16_t host)
{
    if (host == robot->session.host) {
        keeper_numbered(robot);
    }
}
