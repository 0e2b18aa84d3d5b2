/* Where the robot is: encoders, led by position fixes.
 *
 * A fix says where the robot was when it was taken. It is compared with what was thought then, and a quarter of the
 * difference is believed; all of it where they are far apart, since then somebody has moved the robot.
 */
#include "micro/modules.h"

enum { STEP_MOST = 30000, APART_MS = 20, SHARE = 4, FAR_UM = 20000, FAR_ANGLE = 4096 };

static int32_t read_wheel(struct micro *micro, uint8_t side)
{
    int32_t reading = hal_travel(micro->robot.board, side);
    int32_t step = micro_difference(reading, micro->pose.travel[side]);

    micro->pose.travel[side] = reading;
    return step > STEP_MOST ? STEP_MOST : step < -STEP_MOST ? -STEP_MOST : step;
}

static void keep(struct micro *micro)
{
    struct pose *pose = &micro->pose;

    if (micro->robot.time.now - pose->kept >= APART_MS) {
        struct past *past;

        pose->kept = micro->robot.time.now;
        pose->newest = (uint8_t)((pose->newest + 1) % POSES);
        past = &pose->past[pose->newest];
        past->x = pose->x;
        past->y = pose->y;
        past->heading = pose_heading(micro);
    }
}

/* The older fix is held at an age that its type has room for. */
static void age(struct micro *micro)
{
    struct pose *pose = &micro->pose;

    if (micro->robot.time.now - pose->fix_at >= LENGTH_NONE) {
        pose->fix_at = micro->robot.time.now - (LENGTH_NONE - 1U);
    }
}

void pose_start(struct micro *micro)
{
    struct pose *pose = &micro->pose;

    pose->per_um = 683565276UL / hal_track(micro->robot.board); /* 2^32 / 2 pi */
    pose->travel[LEFT] = hal_travel(micro->robot.board, LEFT);
    pose->travel[RIGHT] = hal_travel(micro->robot.board, RIGHT);
}

void pose_step(struct micro *micro)
{
    struct pose *pose = &micro->pose;
    int32_t left = read_wheel(micro, LEFT), right = read_wheel(micro, RIGHT);
    uint32_t turned = (uint32_t)(right - left) * pose->per_um;
    uint16_t middle = (uint16_t)((pose->heading + (uint32_t)((int32_t)turned / 2)) >> 16);
    struct hal_fix fix;

    if (left != 0 || right != 0) {
        pose->moved = micro->robot.time.now;
        pose->x = micro_sum(pose->x, ((left + right) * angles_cosine(middle) + 32768L) >> 16);
        pose->y = micro_sum(pose->y, ((left + right) * angles_sine(middle) + 32768L) >> 16);
        pose->heading += turned;
    }
    keep(micro);
    age(micro);
    if (hal_has_pose(micro->robot.board) && hal_pose(micro->robot.board, &fix)) {
        pose_fix(micro, &fix);
    }
}

void pose_fix(struct micro *micro, const struct hal_fix *fix)
{
    struct pose *pose = &micro->pose;
    uint32_t since = micro->robot.time.now - pose->kept, back;
    int32_t x = pose->x, y = pose->y;
    uint16_t heading = pose_heading(micro);
    struct past *past;
    int16_t turn;

    if (fix->age >= since + APART_MS / 2) {
        back = (fix->age - since + APART_MS / 2) / APART_MS;
        past = &pose->past[(uint8_t)(pose->newest + POSES - (uint8_t)(back < POSES ? back : POSES - 1U)) % POSES];
        x = past->x;
        y = past->y;
        heading = past->heading;
    }
    x = micro_difference(fix->x, x);
    y = micro_difference(fix->y, y);
    turn = (int16_t)(uint16_t)(fix->heading - heading);
    if (pose->fixed && x > -FAR_UM && x < FAR_UM && y > -FAR_UM && y < FAR_UM && angles_size((uint16_t)turn) < FAR_ANGLE) {
        x /= SHARE;
        y /= SHARE;
        turn /= SHARE;
    } else {
        pose->heading &= 0xFFFF0000UL; /* what was thought before is of no account, not even in what no fix can tell */
    }
    pose->x = micro_sum(pose->x, x);
    pose->y = micro_sum(pose->y, y);
    pose->heading += (uint32_t)(uint16_t)turn << 16;
    for (past = pose->past; past < pose->past + POSES; past++) {
        past->x = micro_sum(past->x, x);
        past->y = micro_sum(past->y, y);
        past->heading = (uint16_t)(past->heading + (uint16_t)turn);
    }
    pose->fixed = true;
    pose->fix_at = micro->robot.time.now - fix->age;
}

uint16_t pose_heading(const struct micro *micro)
{
    return (uint16_t)(micro->pose.heading >> 16);
}

uint16_t pose_age(const struct micro *micro)
{
    return micro->pose.fixed ? (uint16_t)(micro->robot.time.now - micro->pose.fix_at) : LENGTH_NONE;
}

bool pose_known(const struct micro *micro)
{
    return pose_age(micro) < micro_milli(micro, MICRO_PARAM_FIX_AGE);
}

int16_t pose_mm(int32_t um)
{
    int32_t most = INT16_MAX * (int32_t)UM_PER_MM, half = um < 0 ? -UM_PER_MM / 2 : UM_PER_MM / 2;

    return um > most ? INT16_MAX : um < -most ? -INT16_MAX : (int16_t)((um + half) / UM_PER_MM);
}
