/* What the robot is doing, and what may change it: every state x every event, in one table. */
#include "core/core.h"

#define STATES ROBOT_STATE_ENUM_END
#define NO 0x80 /* refused; the other bits are the reason */

#define DIS ROBOT_STATE_DISARMED
#define RDY ROBOT_STATE_READY
#define DRV ROBOT_STATE_DRIVING
#define PRF ROBOT_STATE_PERFORMING
#define CNT ROBOT_STATE_COUNTDOWN
#define CON ROBOT_STATE_CONTEST
#define STP ROBOT_STATE_STOPPED
#define NO_ARM (NO | ROBOT_REASON_DISARMED)       /* refused: not armed */
#define NO_EST (NO | ROBOT_REASON_EMERGENCY_STOP) /* refused: e-stop is latched */
#define NO_BSY (NO | ROBOT_REASON_BUSY)           /* refused: something else goes on */

/* Next state, or refusal. An event that changes nothing names its own state. */
static const uint8_t table[STATES][EVENTS] HAL_FLASH = {
    /*          ARM     DISARM ESTOP SESSION DRIVE   MANUAL  PERFORM DONE CONTEST GO   C_STOP RELEASE */
    /* DIS */ {RDY,    DIS,   STP,  DIS,    NO_ARM, NO_ARM, NO_ARM, DIS, NO_ARM, DIS, DIS,   DIS},
    /* RDY */ {RDY,    DIS,   STP,  DIS,    DRV,    DRV,    PRF,    RDY, CNT,    RDY, RDY,   RDY},
    /* DRV */ {DRV,    DIS,   STP,  DIS,    DRV,    DRV,    PRF,    RDY, CNT,    DRV, DRV,   RDY},
    /* PRF */ {PRF,    DIS,   STP,  DIS,    DRV,    NO_BSY, PRF,    RDY, CNT,    PRF, PRF,   RDY},
    /* CNT */ {CNT,    DIS,   STP,  CNT,    NO_BSY, NO_BSY, NO_BSY, CNT, NO_BSY, CON, RDY,   CNT},
    /* CON */ {CON,    DIS,   STP,  CON,    NO_BSY, NO_BSY, NO_BSY, CON, NO_BSY, CON, RDY,   CON},
    /* STP */ {NO_EST, DIS,   STP,  STP,    NO_EST, NO_EST, NO_EST, STP, NO_EST, STP, STP,   STP},
};

uint8_t states_fire(struct robot *robot, uint8_t event, uint8_t reason)
{
    uint8_t cell = flash_u8(&table[robot->state][event]);
    uint8_t before = robot->state;

    if (cell & NO) {
        return (uint8_t)(cell & ~NO);
    }
    if (event == EVENT_ARM && robot->reboot) {
        return ROBOT_REASON_BUSY;
    }
    if (cell != before || event == EVENT_PERFORM) {
        ROLE_OF(robot, interrupt)(robot, event, reason);
    }
    robot->state = cell;
    if (cell != ROBOT_STATE_DRIVING && cell != ROBOT_STATE_PERFORMING && cell != ROBOT_STATE_CONTEST) {
        wheels_stop(robot);
    }
    if (cell == ROBOT_STATE_DISARMED) {
        robot->keeper.by = KEEPER_NONE;
    }
    return ROBOT_REASON_NONE;
}

bool states_armed(const struct robot *robot)
{
    return robot->state != ROBOT_STATE_DISARMED && robot->state != ROBOT_STATE_STOPPED;
}

/* Moving outside a contest, and its keeper is silent: stop. */
void states_watch(struct robot *robot)
{
    if ((robot->state == ROBOT_STATE_DRIVING || robot->state == ROBOT_STATE_PERFORMING)
        && robot->time.now - robot->keeper.heard >= (uint32_t)params_get(robot, ROLE_OF(robot, param_watchdog))) {
        states_fire(robot, EVENT_RELEASE, ROBOT_REASON_WATCHDOG);
        notice_raise(robot, NOTICE_WATCHDOG);
    }
}
