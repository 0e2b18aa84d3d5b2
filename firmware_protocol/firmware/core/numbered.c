/* Numbered messages: a session, a sequence, an answer, and never the same thing twice.
 *
 * The answers to the last few messages are kept: the same message again gets the same answer and does nothing. What is
 * not newer than the newest (serial numbers, so that they may wrap) and not among those is refused as old. That holds
 * for the last few sessions, too: late copies of what opened one of them and of what was said in it do nothing again.
 */
#include "core/core.h"

static void acknowledge(struct robot *robot, struct sender to, uint16_t id, uint16_t session, uint16_t sequence,
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

void numbered_close(struct robot *robot)
{
    robot->session.open = false;
    ROLE_OF(robot, forget)(robot);
}

void numbered_open(struct robot *robot, struct sender from, const mavlink_robot_session_t *request)
{
    struct session *session = &robot->session;

    if (request->major != PROTOCOL_MAJOR || request->host == 0) {
        acknowledge(robot, from, MAVLINK_MSG_ID_ROBOT_SESSION, request->session, request->sequence, ROBOT_REASON_BAD_VALUE);
        return;
    }
    if (!session->open || session->id != request->session) {
        states_fire(robot, EVENT_SESSION, ROBOT_REASON_BY_COMMAND);
        robot->keeper.by = KEEPER_NONE; /* in a contest, too: it is not the new host that armed */
        ROLE_OF(robot, forget)(robot);
        change_session(session, request->session, request->sequence);
        session->host = request->host;
        session->owner = from;
    }
    acknowledge(robot, from, MAVLINK_MSG_ID_ROBOT_SESSION, request->session, request->sequence, ROBOT_REASON_NONE);
}

/* The same message again: the same answer, and what it had asked for if that can be had without moving. */
static void repeat(struct robot *robot, uint16_t id, const union inbound *message, const struct answer *answer)
{
    uint16_t sequence = answer->sequence;

    if (answer->message != (uint8_t)id) {
        acknowledge(robot, robot->session.owner, id, robot->session.id, sequence, ROBOT_REASON_OLD_SEQUENCE);
    } else if (answer->reason != ANSWER_PENDING) {
        numbered_finish(robot, id, sequence, ROLE_OF(robot, repeat)(robot, id, message, answer->reason));
    }
}

void numbered_handle(struct robot *robot, struct sender from, uint16_t id, const union inbound *message)
{
    struct session *session = &robot->session;
    struct answer *answer;
    uint16_t session_id = message->numbered.session, sequence = message->numbered.sequence;
    uint8_t reason;

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
    if (!ROLE_OF(robot, ready)(robot, id)) {
        return; /* the host will repeat it */
    }
    remember(session, id, sequence);
    reason = ROLE_OF(robot, perform)(robot, id, message);
    if (reason != ANSWER_PENDING) {
        numbered_finish(robot, id, sequence, reason);
    } else {
        ROLE_OF(robot, store)(robot);
    }
}

/* Answers, and keeps the answer. */
void numbered_finish(struct robot *robot, uint16_t id, uint16_t sequence, uint8_t reason)
{
    struct answer *answer = find(&robot->session, sequence);
    bool given = reason == ANSWER_GIVEN;

    if (given) {
        reason = ROBOT_REASON_NONE;
    }
    if (answer != NULL) {
        answer->reason = reason;
    }
    if (!given) {
        acknowledge(robot, robot->session.owner, id, robot->session.id, sequence, reason);
    }
}
