/* Numbered messages: a session, a sequence, an answer, and never the same thing twice.
 *
 * The answers to the last few messages are kept: the same message again gets the same answer and does nothing. What is
 * not newer than the newest (serial numbers, so that they may wrap) and not among those is refused as old. That holds
 * for the last few sessions, too: late copies of what opened one of them and of what was said in it do nothing again.
 */
#include "core.h"

static void acknowledge(struct junior *robot, struct sender to, uint16_t id, uint16_t session, uint16_t sequence,
                        uint8_t reason)
{
    mavlink_robot_ack_t ack;

    ack.message = id;
    ack.session = session;
    ack.sequence = sequence;
    ack.target_system = to.system;
    ack.target_component = to.component;
    ack.result = reason == ROBOT_REASON_NONE ? ROBOT_ACK_RESULT_ACCEPTED : ROBOT_ACK_RESULT_REFUSED;
    ack.reason = reason;
    SEND(robot, ROBOT_ACK, &ack);
}

static struct answer *find(struct session *session, uint16_t sequence)
{
    uint8_t i;

    for (i = 0; i < session->answers_used; i++) {
        if (session->answers[i].sequence == sequence) {
            return &session->answers[i];
        }
    }
    return NULL;
}

static void remember(struct session *session, uint16_t id, uint16_t sequence)
{
    struct answer *answer = &session->answers[session->answers_next];

    answer->sequence = sequence;
    answer->message = (uint8_t)id;
    answer->reason = ANSWER_PENDING;
    session->last = sequence;
    session->answers_next = (uint8_t)((session->answers_next + 1) % HISTORY);
    if (session->answers_used < HISTORY) {
        session->answers_used++;
    }
}

/* Closes the session, remembering how far it came, and opens another: at `last`, or where it was when it was closed. */
static void change_session(struct session *session, uint16_t id, uint16_t last)
{
    uint8_t i = 0;

    if (id == session->id) { /* the one that a ground station has closed */
        last = session->last;
    } else {
        while (i < FORMER && session->former[i].id != id) {
            i++;
        }
        if (i < FORMER) {
            last = session->former[i].last;
        } else {
            i = session->former_next;
            session->former_next = (uint8_t)((i + 1) % FORMER);
        }
        session->former[i].id = session->id;
        session->former[i].last = session->last;
    }
    session->id = id;
    session->last = last;
    session->open = true;
    session->answers_used = 0;
    session->answers_next = 0;
}

/* Nobody waits for an answer any more. */
static void forget_questions(struct junior *robot)
{
    robot->maneuver.result_pending = false;
    robot->maneuver.reported = false;
    robot->memory.asked = false;
}

void numbered_close(struct junior *robot)
{
    robot->session.open = false;
    forget_questions(robot);
}

static void open_session(struct junior *robot, struct sender from, const mavlink_robot_session_t *request)
{
    struct session *session = &robot->session;

    if (request->major != PROTOCOL_MAJOR || request->host == 0) {
        acknowledge(robot, from, MAVLINK_MSG_ID_ROBOT_SESSION, request->session, request->sequence, ROBOT_REASON_BAD_VALUE);
        return;
    }
    if (!session->open || session->id != request->session) {
        states_fire(robot, EVENT_SESSION, ROBOT_REASON_BY_COMMAND);
        robot->keeper.by = KEEPER_NONE; /* in a contest, too: it is not the new host that armed */
        forget_questions(robot);
        change_session(session, request->session, request->sequence);
        session->host = request->host;
        session->owner = from;
    }
    acknowledge(robot, from, MAVLINK_MSG_ID_ROBOT_SESSION, request->session, request->sequence, ROBOT_REASON_NONE);
}

static uint8_t perform(struct junior *robot, const mavlink_junior_maneuver_t *request)
{
    struct maneuver_plan plan;
    uint8_t reason;

    if (!maneuver_read(&plan, request->period, request->options, request->count, request->actions)) {
        return ROBOT_REASON_BAD_VALUE;
    }
    reason = states_fire(robot, EVENT_PERFORM, ROBOT_REASON_BY_COMMAND);
    if (reason == ROBOT_REASON_NONE) {
        maneuver_begin(robot, &plan, true, request->sequence);
    }
    return reason;
}

static uint8_t drive(struct junior *robot, const mavlink_junior_wheels_t *request)
{
    uint8_t reason;

    if (request->speed[LEFT] < -1000 || request->speed[LEFT] > 1000 || request->speed[RIGHT] < -1000
        || request->speed[RIGHT] > 1000 || request->duration > 5000) {
        return ROBOT_REASON_BAD_VALUE;
    }
    reason = states_fire(robot, EVENT_DRIVE, ROBOT_REASON_BY_COMMAND);
    if (reason == ROBOT_REASON_NONE) {
        wheels_drive(robot, request->speed[LEFT], request->speed[RIGHT], request->duration);
    }
    return reason;
}

static uint8_t contest(struct junior *robot, const mavlink_junior_contest_t *request)
{
    if (request->command == JUNIOR_CONTEST_COMMAND_STOP) {
        return states_fire(robot, EVENT_CONTEST_STOP, ROBOT_REASON_BY_COMMAND);
    }
    if (request->command != JUNIOR_CONTEST_COMMAND_START || request->countdown > 60000U) {
        return ROBOT_REASON_BAD_VALUE;
    }
    return contest_begin(robot, request->countdown);
}

static uint8_t act(struct junior *robot, uint16_t id, const union inbound *message)
{
    switch (id) {
    case MAVLINK_MSG_ID_JUNIOR_WHEELS:
        return drive(robot, &message->wheels);
    case MAVLINK_MSG_ID_JUNIOR_MANEUVER:
        return perform(robot, &message->maneuver);
    case MAVLINK_MSG_ID_JUNIOR_MEMORY_WRITE:
        return memory_handle_write(robot, &message->memory_write);
    case MAVLINK_MSG_ID_JUNIOR_MEMORY_READ:
        return memory_handle_read(robot, &message->memory_read);
    default:
        return contest(robot, &message->contest);
    }
}

/* Where session and sequence are depends on how wide a message's other fields are. */
static void numbers_of(uint16_t id, const union inbound *message, uint16_t *session, uint16_t *sequence)
{
    switch (id) {
    case MAVLINK_MSG_ID_JUNIOR_WHEELS:
        *session = message->wheels.session;
        *sequence = message->wheels.sequence;
        break;
    case MAVLINK_MSG_ID_JUNIOR_MANEUVER:
        *session = message->maneuver.session;
        *sequence = message->maneuver.sequence;
        break;
    case MAVLINK_MSG_ID_JUNIOR_MEMORY_WRITE:
        *session = message->memory_write.session;
        *sequence = message->memory_write.sequence;
        break;
    case MAVLINK_MSG_ID_JUNIOR_MEMORY_READ:
        *session = message->memory_read.session;
        *sequence = message->memory_read.sequence;
        break;
    default:
        *session = message->contest.session;
        *sequence = message->contest.sequence;
        break;
    }
}

/* The same message again: the same answer, and what it had asked for if that can be had without moving. */
static void repeat(struct junior *robot, uint16_t id, const union inbound *message, const struct answer *answer)
{
    uint16_t sequence = answer->sequence;

    if (answer->message != (uint8_t)id) {
        acknowledge(robot, robot->session.owner, id, robot->session.id, sequence, ROBOT_REASON_OLD_SEQUENCE);
    } else if (id == MAVLINK_MSG_ID_JUNIOR_MEMORY_READ && answer->reason == ROBOT_REASON_NONE) {
        numbered_finish(robot, id, sequence, memory_handle_read(robot, &message->memory_read));
    } else if (answer->reason != ANSWER_PENDING) {
        acknowledge(robot, robot->session.owner, id, robot->session.id, sequence, answer->reason);
        if (id == MAVLINK_MSG_ID_JUNIOR_MANEUVER && robot->maneuver.result.sequence == sequence
            && robot->maneuver.reported && robot->maneuver.phase == PHASE_IDLE) {
            robot->maneuver.result_pending = true;
            robot->maneuver.result_due = robot->time.now;
        }
    }
}

void numbered_handle(struct junior *robot, struct sender from, uint16_t id, const union inbound *message)
{
    struct session *session = &robot->session;
    struct answer *answer;
    uint16_t session_id, sequence;
    uint8_t reason;

    if (id == MAVLINK_MSG_ID_ROBOT_SESSION) {
        open_session(robot, from, &message->session);
        return;
    }
    numbers_of(id, message, &session_id, &sequence);
    if (!session->open || session_id != session->id) {
        acknowledge(robot, from, id, session_id, sequence, ROBOT_REASON_WRONG_SESSION);
        return;
    }
    session->owner = from;
    keeper_numbered(robot);
    answer = find(session, sequence);
    if (answer != NULL) {
        repeat(robot, id, message, answer);
        return;
    }
    if ((int16_t)(uint16_t)(sequence - session->last) <= 0) {
        acknowledge(robot, from, id, session_id, sequence, ROBOT_REASON_OLD_SEQUENCE);
        return;
    }
    if (id == MAVLINK_MSG_ID_JUNIOR_MEMORY_WRITE && !memory_ready(robot)) {
        return; /* still storing something: the host will repeat it */
    }
    remember(session, id, sequence);
    reason = act(robot, id, message);
    if (reason != ANSWER_PENDING) {
        numbered_finish(robot, id, sequence, reason);
    } else {
        memory_step(robot);
    }
}

/* Answers, and keeps the answer. What a read asked for is its own answer. */
void numbered_finish(struct junior *robot, uint16_t id, uint16_t sequence, uint8_t reason)
{
    struct answer *answer = find(&robot->session, sequence);

    if (answer != NULL) {
        answer->reason = reason;
    }
    if (id != MAVLINK_MSG_ID_JUNIOR_MEMORY_READ || reason != ROBOT_REASON_NONE) {
        acknowledge(robot, robot->session.owner, id, robot->session.id, sequence, reason);
    }
}
