/* Observations: of moves, repeated until somebody has them, and those that are asked for. */
#include "micro/modules.h"

enum { FIRST_MS = 250, LAST_MS = 1000 };

static uint16_t own_session(const struct micro *micro)
{
    return micro->robot.session.open ? micro->robot.session.id : 0;
}

static uint16_t millimetres(int32_t um) /* of a way: none, where it went back */
{
    int32_t mm = (um + UM_PER_MM / 2) / UM_PER_MM;

    return mm < 0 ? 0 : mm >= LENGTH_NONE ? LENGTH_NONE : (uint16_t)mm;
}

static void tell_pose(const struct micro *micro, mavlink_swarm_observation_t *told)
{
    const struct pose *pose = &micro->pose;

    told->time = micro->robot.time.micros;
    told->session = own_session(micro);
    told->position[0] = pose_mm(pose->x);
    told->position[1] = pose_mm(pose->y);
    told->heading = angles_to_wire(pose_heading(micro));
    told->travelled = millimetres(micro->move.travelled);
    told->fix_age = pose_age(micro);
    if (move_contact_ahead(micro)) {
        told->flags |= SWARM_OBSERVATION_FLAG_CONTACT_AHEAD;
    }
    if (micro->bumps != 0) {
        told->flags |= SWARM_OBSERVATION_FLAG_CONTACT;
    }
    if (!pose_known(micro)) {
        told->flags |= SWARM_OBSERVATION_FLAG_DEAD_RECKONING;
    }
}

#if MICRO_RING

static void tell_ring(const struct micro *micro, mavlink_swarm_observation_t *told)
{
    const struct reading *reading = &micro->ring.reading;

    told->radius = reading->radius;
    told->radius_before = reading->radius_before;
    memcpy(told->near, reading->near, sizeof reading->near);
    memcpy(told->seen, reading->seen, sizeof reading->seen);
    memcpy(told->count, reading->count, sizeof reading->count);
    memcpy(told->count_before, reading->count_before, sizeof reading->count_before);
}

static void tell_box(const struct micro *micro, mavlink_swarm_observation_t *told)
{
    uint16_t bearing, distance;

    if (hal_box(micro->robot.board, &bearing, &distance)) {
        told->box_bearing = angles_to_wire(bearing);
        told->box_distance = distance;
    }
    if (hal_goal(micro->robot.board, &bearing)) {
        told->goal_bearing = angles_to_wire(bearing);
    }
}

#endif

/* sensed: what the ring has read last is of here and now. */
static void observe(struct micro *micro, mavlink_swarm_observation_t *told, uint16_t sequence, bool sensed)
{
    memset(told, 0, sizeof *told);
    told->sequence = sequence;
    told->box_bearing = ANGLE_NONE;
    told->box_distance = LENGTH_NONE;
    told->goal_bearing = ANGLE_NONE;
    tell_pose(micro, told);
#if MICRO_RING
    if (hal_touch(micro->robot.board)) {
        told->flags |= SWARM_OBSERVATION_FLAG_TOUCHES_BOX;
    }
    if (sensed) {
        tell_box(micro, told);
    }
    if (sensed && ring_fitted(micro)) {
        tell_ring(micro, told);
        return;
    }
#else
    (void)sensed;
#endif
    told->flags |= SWARM_OBSERVATION_FLAG_RING_NOT_READ;
    told->radius = ring_setting(micro)->radius;
    told->radius_before = micro->ring.before;
}

/* The radius that the next observation counts by, too. */
static void remember(struct micro *micro, const mavlink_swarm_observation_t *told)
{
    if (!(told->flags & SWARM_OBSERVATION_FLAG_RING_NOT_READ)) {
        micro->ring.before = told->radius;
    }
}

#if MICRO_RING

static void tell_ranges(struct micro *micro, mavlink_swarm_ranges_t *told, uint16_t sequence)
{
    uint8_t i;

    memset(told, 0, sizeof *told);
    told->time = micro->robot.time.micros;
    told->session = own_session(micro);
    told->sequence = sequence;
    told->position[0] = pose_mm(micro->pose.x);
    told->position[1] = pose_mm(micro->pose.y);
    told->heading = angles_to_wire(pose_heading(micro));
    told->count = ring_setting(micro)->ranges;
    for (i = 0; i < told->count; i++) {
        bool robot;

        told->ranges[i] = hal_range(micro->robot.board, i, &robot);
        told->robots |= (uint32_t)robot << i;
    }
}

/* Where there is no ring, there are none. */
static bool wants_ranges(const struct micro *micro)
{
    return ring_fitted(micro) && (micro->move.options & SWARM_MOVE_OPTION_RANGES) != 0;
}

#endif

/* --- of a move ---------------------------------------------------------------------------------------------------- */

void observation_end(struct micro *micro, bool sensed)
{
    struct observations *all = &micro->observations;
    const struct move *move = &micro->move;

    observe(micro, &all->ended, move->sequence, sensed);
    all->ended.outcome = move->outcome;
    all->ended.reason = move->reason;
    remember(micro, &all->ended);
    all->interval = FIRST_MS;
    all->due = micro->robot.time.now;
#if MICRO_RING
    all->ranges_pending = wants_ranges(micro);
    if (all->ranges_pending) {
        tell_ranges(micro, &all->ranges, move->sequence);
    }
#endif
}

void observation_send_now(struct micro *micro)
{
    SEND(&micro->robot, SWARM_OBSERVATION, &micro->observations.ended);
}

void observation_report(struct micro *micro)
{
    struct observations *all = &micro->observations;

    if (micro->move.phase != MOVE_REPORT) {
        return;
    }
    if (time_due(&micro->robot, all->due) && SEND(&micro->robot, SWARM_OBSERVATION, &all->ended)) {
        all->due = micro->robot.time.now + all->interval;
        all->interval = (uint16_t)(all->interval < LAST_MS ? 2U * all->interval : LAST_MS);
#if MICRO_RING
        all->ranges_pending = wants_ranges(micro);
    }
    if (all->ranges_pending && SEND(&micro->robot, SWARM_RANGES, &all->ranges)) {
        all->ranges_pending = false;
#endif
    }
}

void observation_pass(struct micro *micro)
{
    if (micro->move.phase == MOVE_REPORT && micro->observations.interval == FIRST_MS) {
        observation_send_now(micro);
    }
    move_drop(micro);
}

/* --- asked for ---------------------------------------------------------------------------------------------------- */

uint8_t observation_ask(struct micro *micro, uint8_t stream, const mavlink_command_long_t *command)
{
    const struct session *session = &micro->robot.session;
    bool held = session->open && command->param3 > 0.0f && protocol_number(command->param3) == session->host;
    uint8_t asker = held ? ASKER_HOLDER : ASKER_WATCHER;

    if (stream == STREAM_RANGES && !ring_fitted(micro)) {
        return MAV_RESULT_DENIED;
    }
    micro->observations.asked[stream][asker].sequence = protocol_number(command->param2);
    micro->observations.asked[stream][asker].pending = true;
    ring_ask(micro);
    return MAV_RESULT_ACCEPTED;
}

static bool answer_ranges(struct micro *micro, uint16_t sequence)
{
#if MICRO_RING
    mavlink_swarm_ranges_t told;

    if (!ring_fitted(micro)) {
        return true; /* by an interval */
    }
    tell_ranges(micro, &told, sequence);
    return SEND(&micro->robot, SWARM_RANGES, &told);
#else
    (void)micro;
    (void)sequence;
    return true;
#endif
}

static bool answer(struct micro *micro, uint16_t sequence, uint8_t asker)
{
    mavlink_swarm_observation_t told;

    observe(micro, &told, sequence, true);
    if (!SEND(&micro->robot, SWARM_OBSERVATION, &told)) {
        return false;
    }
    if (asker == ASKER_HOLDER) {
        remember(micro, &told);
    }
    return true;
}

/* By an interval it goes to nobody in particular. */
bool observation_answer(struct micro *micro, uint8_t stream)
{
    struct observations *all = &micro->observations;
    uint8_t asker, asked = 0;

    for (asker = 0; asker < ASKERS; asker++) {
        asked = (uint8_t)(asked + all->asked[stream][asker].pending);
    }
    if (asked == 0) {
        all->asked[stream][ASKER_WATCHER].sequence = 0;
        all->asked[stream][ASKER_WATCHER].pending = true;
        ring_ask(micro);
    }
    for (asker = 0; asker < ASKERS; asker++) {
        if (all->asked[stream][asker].pending) {
            uint16_t sequence = all->asked[stream][asker].sequence;

            if (micro->ring.busy
                || !(stream == STREAM_RANGES ? answer_ranges(micro, sequence) : answer(micro, sequence, asker))) {
                return false;
            }
            all->asked[stream][asker].pending = false;
        }
    }
    return true;
}
