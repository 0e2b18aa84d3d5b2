/* The move controller: turn, drive, face, sense, report. */
#include "micro/modules.h"

/* The wheels are led by what is left: a turn ends at TURN_RATE times the angle, a drive at DRIVE_RATE times the way, a second. */
enum { TURN_RATE_PI = 38 /* 12 / s, times pi */, DRIVE_RATE = 15, LEAST_UM_S = 10000 };
#define LOOK_AHEAD_UM 40000L
enum { BUMPERS = 8, BISECTOR = 4096, AHEAD = 10923 /* 60 degrees */, SPARE_MS = 1000 };
#define HALF_TURN 32768U
#define DISTANCE_MOST 60000U
enum { SECTORS_MOST = 16, EFFORT_MOST = 100, FULL = 1000, OPTIONS = 63 /* every bit */ };

enum move_event {
    ON_BEGIN,
    ON_REACHED, /* what the phase is for is done */
    ON_ENDED,   /* by contact, time, or what the states decided */
    ON_DROP,    /* nobody waits for its observation any more */
    ON_REPEAT,  /* it is wanted again */
    ON_EVENTS
};

#define IDL MOVE_IDLE
#define TRN MOVE_TURN
#define DRV MOVE_DRIVE
#define FAC MOVE_FACE
#define SNS MOVE_SENSE
#define RPT MOVE_REPORT

static const uint8_t table[MOVE_PHASES][ON_EVENTS] HAL_FLASH = {
    /*          BEGIN REACHED ENDED DROP REPEAT */
    /* IDL */ {TRN,  IDL,    IDL,  IDL, RPT},
    /* TRN */ {TRN,  DRV,    SNS,  TRN, TRN},
    /* DRV */ {TRN,  FAC,    SNS,  DRV, DRV},
    /* FAC */ {TRN,  SNS,    SNS,  FAC, FAC},
    /* SNS */ {TRN,  RPT,    SNS,  SNS, SNS},
    /* RPT */ {TRN,  RPT,    RPT,  IDL, RPT},
};

static bool under_way(const struct move *move)
{
    return move->phase == MOVE_TURN || move->phase == MOVE_DRIVE || move->phase == MOVE_FACE;
}

static bool senses(const struct move *move)
{
    return (move->options & SWARM_MOVE_OPTION_SENSE) != 0;
}

static void fire(struct micro *micro, uint8_t event)
{
    struct move *move = &micro->move;
    uint8_t before = move->phase;

    move->phase = flash_u8(&table[before][event]);
    if (move->phase == before) {
        return;
    }
    switch (move->phase) {
    case MOVE_DRIVE:
        move->from_x = micro->pose.x;
        move->from_y = micro->pose.y;
        move->begun = micro->robot.time.now;
        break;
    case MOVE_SENSE:
        wheels_stop(&micro->robot);
        if (move->options & (SWARM_MOVE_OPTION_SENSE | SWARM_MOVE_OPTION_RANGES)) {
            ring_ask(micro);
        }
        break;
    default:
        break;
    }
}

static void end(struct micro *micro, uint8_t outcome, uint8_t reason)
{
    micro->move.outcome = outcome;
    micro->move.reason = reason;
    fire(micro, ON_ENDED);
}

/* --- what is asked for -------------------------------------------------------------------------------------------- */

static bool valid(const mavlink_swarm_move_t *request)
{
    return request->distance <= DISTANCE_MOST && request->sectors <= SECTORS_MOST && request->sector <= request->sectors
           && (request->heading != ANGLE_NONE || request->sector != 0) && request->effort <= EFFORT_MOST
           && (request->options & ~OPTIONS) == 0;
}

static uint16_t way_of(const struct micro *micro, const mavlink_swarm_move_t *request)
{
    uint16_t way;

    if (request->heading == ANGLE_NONE) {
        way = (uint16_t)((2UL * request->sector - 1UL) * HALF_TURN / request->sectors);
    } else {
        way = angles_from_wire(request->heading);
        if (!(request->options & SWARM_MOVE_OPTION_BODY)) {
            return way;
        }
    }
    return (uint16_t)(way + pose_heading(micro));
}

static uint32_t turning_ms(const struct micro *micro, uint16_t angle)
{
    return ((uint32_t)angles_size(angle) * 6283UL >> 16) * 1000U / micro_milli(micro, MICRO_PARAM_TURN_SPEED);
}

/* Twice the planned time and a second; three times that, where something has to be pushed. */
static uint32_t longest_ms(const struct micro *micro, uint16_t distance)
{
    const struct move *move = &micro->move;
    uint32_t planned = turning_ms(micro, (uint16_t)(move->nose - pose_heading(micro)));

    planned += (uint32_t)distance * 1000U / move->speed;
    if (move->facing) {
        planned += turning_ms(micro, (uint16_t)(move->face - move->nose));
    }
    return planned * (move->options & SWARM_MOVE_OPTION_PUSH ? 3U : 2U) + SPARE_MS;
}

static void begin(struct micro *micro, const mavlink_swarm_move_t *request, uint16_t way)
{
    struct move *move = &micro->move;

    move->options = request->options;
    move->effort = request->effort == 0 ? EFFORT_MOST : request->effort;
    move->outcome = SWARM_OUTCOME_ARRIVED;
    move->reason = ROBOT_REASON_NONE;
    move->reported = true;
    move->sequence = request->sequence;
    move->way = way;
    move->nose = (uint16_t)(request->options & SWARM_MOVE_OPTION_BACKWARD ? way + HALF_TURN : way);
    move->facing = request->face != ANGLE_NONE;
    move->face = angles_from_wire(request->face);
    move->speed = request->speed == 0 ? micro_milli(micro, MICRO_PARAM_MOVE_SPEED) : request->speed;
    move->distance = (int32_t)request->distance * UM_PER_MM;
    move->travelled = 0;
    move->deadline = micro->robot.time.now + longest_ms(micro, request->distance);
    micro->robot.counters.maneuvers++;
    fire(micro, ON_BEGIN);
}

uint8_t move_request(struct micro *micro, const mavlink_swarm_move_t *request)
{
    uint16_t way;
    uint8_t reason;

    if (!valid(request)) {
        return ROBOT_REASON_BAD_VALUE;
    }
    way = way_of(micro, request);
    if (request->distance != 0 && fence_there(micro)) {
        if (!pose_known(micro)) {
            return ROBOT_REASON_NOT_FOUND;
        }
        if (fence_leaves(micro, way, request->distance)) {
            return ROBOT_REASON_BAD_VALUE;
        }
    }
    reason = states_fire(&micro->robot, EVENT_PERFORM, ROBOT_REASON_BY_COMMAND);
    if (reason == ROBOT_REASON_NONE) {
        begin(micro, request, way);
    }
    return reason;
}

/* --- how it goes -------------------------------------------------------------------------------------------------- */

static int32_t limited(int32_t value, int32_t most)
{
    return value > most ? most : value < -most ? -most : value;
}

static void set_wheels(struct micro *micro, int32_t forward, int32_t turn)
{
    int32_t full = hal_full_speed(micro->robot.board); /* mm/s: um/s of it are permille */

    turn = limited(turn / full, FULL);
    forward = limited(forward / full, FULL - (turn < 0 ? -turn : turn)); /* where there is not enough, it turns first */
    micro->robot.wheels.effort[LEFT] = (int16_t)(forward - turn);
    micro->robot.wheels.effort[RIGHT] = (int16_t)(forward + turn);
}

/* What a wheel does (um/s) so that the robot turns by what is left. */
static int32_t turning(const struct micro *micro, int16_t left)
{
    int32_t track = (int32_t)hal_track(micro->robot.board);
    int32_t most = (int32_t)micro_milli(micro, MICRO_PARAM_TURN_SPEED) * (track / 2) / 1000;

    return limited(left * (track * TURN_RATE_PI >> 16), most);
}

static void turn_step(struct micro *micro, uint16_t heading)
{
    uint16_t left = (uint16_t)(heading - pose_heading(micro));

    if (angles_size(left) <= angles_from_milli(micro_milli(micro, MICRO_PARAM_ARRIVE_ANGLE))) {
        fire(micro, ON_REACHED);
    } else {
        set_wheels(micro, 0, turning(micro, (int16_t)left));
    }
}

/* A sector that is closed, and whose bisector lies near the way. */
bool move_contact_ahead(const struct micro *micro)
{
    uint16_t bisector = (uint16_t)(BISECTOR + pose_heading(micro) - micro->move.way);
    uint8_t bumps = micro->bumps, i;

    for (i = 0; i < BUMPERS; i++) {
        if (bumps & 0x80 && angles_size(bisector) <= AHEAD) {
            return true;
        }
        bumps = (uint8_t)(bumps << 1);
        bisector = (uint16_t)(bisector + 2 * BISECTOR);
    }
    return false;
}

static bool stalls(const struct micro *micro)
{
    uint32_t now = micro->robot.time.now, most = micro_milli(micro, MICRO_PARAM_STALL_TIME);

    return now - micro->pose.moved >= most && now - micro->move.begun >= most;
}

/* True: it has come to an end. */
static bool drive_ends(struct micro *micro)
{
    struct move *move = &micro->move;
    uint16_t heading = (uint16_t)(pose_heading(micro) + move->way - move->nose); /* backward it drives to its tail */

    if (move->distance - move->travelled <= (int32_t)micro_milli(micro, MICRO_PARAM_ARRIVE_DIST) * UM_PER_MM) {
        fire(micro, ON_REACHED);
    } else if (fence_there(micro) && !pose_known(micro)) {
        end(micro, SWARM_OUTCOME_REFUSED, ROBOT_REASON_NOT_FOUND);
    } else if (fence_there(micro) && fence_crossed(micro, move->way, heading)) {
        end(micro, SWARM_OUTCOME_STOPPED, ROBOT_REASON_BAD_VALUE);
    } else if ((move->options & (SWARM_MOVE_OPTION_STOP_ON_CONTACT | SWARM_MOVE_OPTION_PUSH)) == SWARM_MOVE_OPTION_STOP_ON_CONTACT
               && (move_contact_ahead(micro) || stalls(micro))) {
        end(micro, SWARM_OUTCOME_BLOCKED, ROBOT_REASON_NONE);
    } else {
        return false;
    }
    return true;
}

static void drive_step(struct micro *micro)
{
    struct move *move = &micro->move;
    int16_t sine = angles_sine(move->way), cosine = angles_cosine(move->way);
    int32_t x = micro_difference(micro->pose.x, move->from_x), y = micro_difference(micro->pose.y, move->from_y), speed, aside;
    uint16_t heading;

    move->travelled = angles_scale(x, cosine) + angles_scale(y, sine);
    if (drive_ends(micro)) {
        return;
    }
    aside = angles_scale(y, cosine) - angles_scale(x, sine); /* to the left of the way */
    heading = (uint16_t)(move->nose - angles_of(limited(aside, 4L * LOOK_AHEAD_UM), LOOK_AHEAD_UM));
    speed = limited(move->distance - move->travelled, (int32_t)move->speed * UM_PER_MM) * DRIVE_RATE;
    speed = limited(speed < LEAST_UM_S ? LEAST_UM_S : speed, (int32_t)move->speed * UM_PER_MM);
    set_wheels(micro, move->options & SWARM_MOVE_OPTION_BACKWARD ? -speed : speed,
                turning(micro, (int16_t)(uint16_t)(heading - pose_heading(micro))));
}

static void report(struct micro *micro)
{
    fire(micro, ON_REACHED);
    if (micro->move.reported) {
        observation_end(micro, senses(&micro->move));
    } else {
        fire(micro, ON_DROP);
    }
    if (micro->robot.state == ROBOT_STATE_PERFORMING) {
        states_fire(&micro->robot, EVENT_DONE, ROBOT_REASON_NONE);
    }
}

void move_step(struct micro *micro)
{
    struct move *move = &micro->move;

    if (under_way(move) && time_due(&micro->robot, move->deadline)) {
        end(micro, SWARM_OUTCOME_TIMED_OUT, ROBOT_REASON_NONE);
    }
    if (move->phase == MOVE_TURN) {
        turn_step(micro, move->nose);
    }
    if (move->phase == MOVE_DRIVE) {
        drive_step(micro);
    }
    if (move->phase == MOVE_FACE) {
        turn_step(micro, move->facing ? move->face : pose_heading(micro));
    }
    if (move->phase == MOVE_SENSE && !micro->ring.busy) {
        report(micro);
    }
    hal_force(micro->robot.board, under_way(move) ? move->effort : EFFORT_MOST);
}

/* Another move takes its place: what is known is said at once. Any other end is looked at from where it stands. */
void move_interrupt(struct micro *micro, uint8_t event, uint8_t reason)
{
    struct move *move = &micro->move;

    if (event == EVENT_PERFORM && (under_way(move) || move->phase == MOVE_SENSE)) {
        if (under_way(move)) {
            move->outcome = SWARM_OUTCOME_REPLACED;
            move->reason = reason;
        }
        observation_end(micro, false);
        observation_send_now(micro);
    } else if (under_way(move)) {
        end(micro, SWARM_OUTCOME_STOPPED, reason);
    }
}

void move_drop(struct micro *micro)
{
    fire(micro, ON_DROP);
}

void move_repeat(struct micro *micro)
{
    fire(micro, ON_REPEAT);
    micro->observations.due = micro->robot.time.now;
}
