/* The maneuver memory: which maneuver answers which stimulus, in non-volatile memory.
 *
 * A slot is 16 bytes: previous stimulus, current stimulus, options (low bits) and turn (high two), actions, period,
 * checksum, and as the mark the number of actions. There is one slot more than MEM_SLOTS: a maneuver that replaces
 * another is written to a free slot first, then the old one is blanked. After a power cut in between, both are there
 * and the turn (0..2) tells which is newer. The checksum of the table runs over the used slots sorted by previous, then
 * current stimulus, as stored but without turn and checksum: it depends on what is stored, not on how it came there.
 */
#include "junior/modules.h"

enum {
    PHYSICAL = MEMORY_SLOTS + 1,
    AT_PREVIOUS = 0,
    AT_CURRENT = 1,
    AT_OPTIONS = 2,
    AT_ACTIONS = 3,
    AT_PERIOD = 11,
    AT_CRC = 13,
    AT_COUNT = 15,
    TURN_BIT = 6,
    TURNS = 3,
    STIMULI = 16,
    BLANK = 0xFF,
    BY_STIMULI = 255,
};

/* There is room for the slots, and for one that is being written. */
typedef char memory_fits[PHYSICAL * MEMORY_SLOT_SIZE <= NVM_ROLE_SIZE ? 1 : -1];
typedef char slot_fits[MEMORY_SLOT_SIZE <= (int)NVM_LONGEST ? 1 : -1];

static uint8_t read(struct junior *junior, uint8_t slot, uint8_t at)
{
    return hal_nvm_read(junior->robot.board, (uint16_t)(NVM_ROLE_ADDRESS + slot * MEMORY_SLOT_SIZE + at));
}

static bool stimulus_ok(uint8_t previous, uint8_t current)
{
    return current < STIMULI && (previous < STIMULI || previous == ANY_STIMULUS);
}

static bool intact(struct junior *junior, uint8_t slot)
{
    uint8_t i, count = read(junior, slot, AT_COUNT);
    uint16_t crc = 0xFFFF;

    if (count < 1 || count > MAX_ACTIONS || !stimulus_ok(read(junior, slot, AT_PREVIOUS), read(junior, slot, AT_CURRENT))) {
        return false;
    }
    for (i = 0; i < AT_CRC; i++) {
        crc = wire_crc(crc, read(junior, slot, i));
    }
    crc = wire_crc(crc, count);
    return read(junior, slot, AT_CRC) == (uint8_t)crc && read(junior, slot, AT_CRC + 1) == (uint8_t)(crc >> 8);
}

static uint16_t key(struct junior *junior, uint8_t slot)
{
    return (uint16_t)((uint16_t)read(junior, slot, AT_PREVIOUS) << 8 | read(junior, slot, AT_CURRENT));
}

/* Into its place by key; after the one that has the same key. */
static void include(struct junior *junior, uint8_t slot)
{
    struct memory *memory = &junior->memory;
    uint16_t slot_key = key(junior, slot);
    uint8_t at = memory->used++;

    memory->checked = false;
    while (at > 0 && key(junior, memory->order[at - 1]) > slot_key) {
        memory->order[at] = memory->order[at - 1];
        at--;
    }
    memory->order[at] = slot;
}

static void exclude(struct junior *junior, uint8_t slot)
{
    struct memory *memory = &junior->memory;
    uint8_t at, kept = 0;

    memory->checked = false;
    for (at = 0; at < memory->used; at++) {
        if (memory->order[at] != slot) {
            memory->order[kept++] = memory->order[at];
        }
    }
    memory->used = kept;
}

/* What becomes of each bit of a CRC over 14 zeros: the bytes of a slot that count. */
static const uint16_t over_slot[16] HAL_FLASH = {
    0x7EEA, 0xFDD4, 0xF3B9, 0xEF63, 0xD6D7, 0xA5BF, 0x436F, 0x86DE, /* bit 0 .. */
    0x05AD, 0x0B5A, 0x16B4, 0x2D68, 0x5AD0, 0xB5A0, 0x6351, 0xC6A2,
};
#define TURN_1 0x5760U /* what the bits of the turn add to a slot's CRC */
#define TURN_2 0xAEC0U

/* Computed when somebody asks, from the slots' own checksums: a third of the time that it takes to read every byte, which
 * would be most of a control period on a micro-controller.
 *
 * A CRC is linear: the same bytes from two starting values differ by what the difference of these becomes over zeros. A
 * slot's own CRC starts at 0xFFFF and has the turn in it. So what the slots before have come to goes over zeros, and the
 * slot's own CRC is added, less the turn: as if the slot's bytes had gone through.
 */
static uint16_t checksum(struct junior *junior)
{
    struct memory *memory = &junior->memory;
    uint16_t before, crc = 0xFFFF;
    uint8_t at, bit, slot, turn;

    if (memory->checked) {
        return memory->checksum;
    }
    for (at = 0; at < memory->used; at++) {
        slot = memory->order[at];
        turn = read(junior, slot, AT_OPTIONS) >> TURN_BIT;
        before = (uint16_t)~crc;
        crc = (uint16_t)(read(junior, slot, AT_CRC) | (uint16_t)read(junior, slot, AT_CRC + 1) << 8);
        crc ^= turn == 1 ? TURN_1 : turn == 2 ? TURN_2 : 0;
        for (bit = 0; before != 0; bit++, before >>= 1) {
            if (before & 1U) {
                crc ^= flash_u16(&over_slot[bit]);
            }
        }
    }
    memory->checksum = crc;
    memory->checked = true;
    return crc;
}

uint8_t memory_find(struct junior *junior, uint8_t previous, uint8_t current)
{
    uint16_t wanted = (uint16_t)((uint16_t)previous << 8 | current);
    uint8_t at;

    for (at = 0; at < junior->memory.used; at++) {
        if (key(junior, junior->memory.order[at]) == wanted) {
            return junior->memory.order[at];
        }
    }
    return MEMORY_NONE;
}

static void erase(struct junior *junior, uint8_t slot)
{
    exclude(junior, slot);
    junior->robot.nvm.data[0] = BLANK;
    nvm_begin(&junior->robot, (uint16_t)(NVM_ROLE_ADDRESS + slot * MEMORY_SLOT_SIZE + AT_COUNT), 1);
}

/* Takes a slot that is found at boot. Of two with the same key, the power went before the older one was blanked. */
static void find_again(struct junior *junior, uint8_t slot)
{
    uint8_t other = memory_find(junior, read(junior, slot, AT_PREVIOUS), read(junior, slot, AT_CURRENT));

    include(junior, slot);
    if (other != MEMORY_NONE) {
        uint8_t turn = read(junior, slot, AT_OPTIONS) >> TURN_BIT;
        uint8_t other_turn = read(junior, other, AT_OPTIONS) >> TURN_BIT;

        erase(junior, other_turn == (turn + 1) % TURNS ? slot : other);
    } else if (junior->memory.used > MEMORY_SLOTS) { /* nothing of ours leaves it like that */
        erase(junior, slot);
    }
    nvm_flush(&junior->robot);
}

void memory_load(struct junior *junior)
{
    uint8_t slot;

    for (slot = 0; slot < PHYSICAL; slot++) {
        if (intact(junior, slot)) {
            find_again(junior, slot);
        }
    }
}

/* False when the slot has rotted since boot. */
bool memory_plan(struct junior *junior, uint8_t slot, struct maneuver_plan *plan)
{
    uint8_t i;

    plan->period = (uint16_t)(read(junior, slot, AT_PERIOD) | (uint16_t)read(junior, slot, AT_PERIOD + 1) << 8);
    plan->options = read(junior, slot, AT_OPTIONS) & MANEUVER_OPTIONS;
    plan->count = read(junior, slot, AT_COUNT);
    for (i = 0; i < MAX_ACTIONS; i++) {
        plan->actions[i] = read(junior, slot, (uint8_t)(AT_ACTIONS + i));
    }
    return maneuver_valid(plan);
}

/* At most MEM_SLOTS of the slots are used: there is always one. */
static uint8_t free_slot(const struct junior *junior)
{
    uint8_t slot = 0;

    while (memchr(junior->memory.order, slot, junior->memory.used) != NULL) {
        slot++;
    }
    return slot;
}

static void write(struct junior *junior, const mavlink_junior_memory_write_t *request, uint8_t slot, uint8_t turn)
{
    uint8_t *data = junior->robot.nvm.data;
    uint16_t crc = 0xFFFF;
    uint8_t i;

    data[AT_PREVIOUS] = request->previous;
    data[AT_CURRENT] = request->current;
    data[AT_OPTIONS] = (uint8_t)(request->options | turn << TURN_BIT);
    memcpy(data + AT_ACTIONS, request->actions, MAX_ACTIONS);
    data[AT_PERIOD] = (uint8_t)request->period;
    data[AT_PERIOD + 1] = (uint8_t)(request->period >> 8);
    data[AT_COUNT] = request->count;
    for (i = 0; i < AT_CRC; i++) {
        crc = wire_crc(crc, data[i]);
    }
    crc = wire_crc(crc, data[AT_COUNT]);
    data[AT_CRC] = (uint8_t)crc;
    data[AT_CRC + 1] = (uint8_t)(crc >> 8);
    nvm_begin(&junior->robot, (uint16_t)(NVM_ROLE_ADDRESS + slot * MEMORY_SLOT_SIZE), MEMORY_SLOT_SIZE);
}

bool memory_ready(const struct junior *junior)
{
    return junior->memory.job == JOB_NONE && nvm_idle(&junior->robot);
}

/* A Reason; or ANSWER_PENDING: memory_step answers when the bytes are where they belong. Wants memory_ready. */
uint8_t memory_handle_write(struct junior *junior, const mavlink_junior_memory_write_t *request)
{
    struct memory *memory = &junior->memory;
    struct maneuver_plan plan;
    uint8_t old, turn;

    if (junior->robot.state == ROBOT_STATE_COUNTDOWN || junior->robot.state == ROBOT_STATE_CONTEST) {
        return ROBOT_REASON_BUSY;
    }
    memory->sequence = request->sequence;
    memory->asked = true;
    if (request->count == 0 && request->previous == ANY_STIMULUS && request->current == ANY_STIMULUS) {
        memory->job = JOB_ERASE_ALL;
        return ANSWER_PENDING;
    }
    if (!stimulus_ok(request->previous, request->current)) {
        return ROBOT_REASON_BAD_VALUE;
    }
    old = memory_find(junior, request->previous, request->current);
    if (request->count == 0) {
        if (old != MEMORY_NONE) {
            erase(junior, old);
        }
        memory->job = JOB_ERASE_OLD;
        memory->old = MEMORY_NONE;
        return ANSWER_PENDING;
    }
    if (!maneuver_read(&plan, request->period, request->options, request->count, request->actions)) {
        return ROBOT_REASON_BAD_VALUE;
    }
    if (old == MEMORY_NONE && memory->used >= MEMORY_SLOTS) {
        return ROBOT_REASON_MEMORY_FULL;
    }
    memory->old = old;
    memory->slot = free_slot(junior);
    memory->job = JOB_WRITE;
    turn = old == MEMORY_NONE ? 0 : (uint8_t)(((read(junior, old, AT_OPTIONS) >> TURN_BIT) + 1) % TURNS);
    write(junior, request, memory->slot, turn);
    return ANSWER_PENDING;
}

static void answer(struct junior *junior, uint8_t reason)
{
    junior->memory.job = JOB_NONE;
    if (junior->memory.asked) {
        numbered_finish(&junior->robot, MAVLINK_MSG_ID_JUNIOR_MEMORY_WRITE, junior->memory.sequence, reason);
    }
}

/* Goes on with a write as far as the hardware lets it. */
void memory_step(struct junior *junior)
{
    struct memory *memory = &junior->memory;

    while (memory->job != JOB_NONE && nvm_idle(&junior->robot)) {
        switch (memory->job) {
        case JOB_WRITE:
            if (!intact(junior, memory->slot)) { /* worn out */
                answer(junior, ROBOT_REASON_STORAGE_FAILED);
                break;
            }
            include(junior, memory->slot);
            if (memory->old != MEMORY_NONE) {
                erase(junior, memory->old);
            }
            memory->job = JOB_ERASE_OLD;
            break;
        case JOB_ERASE_OLD:
            answer(junior, ROBOT_REASON_NONE);
            break;
        default: /* JOB_ERASE_ALL */
            if (memory->used == 0) {
                answer(junior, ROBOT_REASON_NONE);
            } else {
                erase(junior, memory->order[memory->used - 1]);
            }
            break;
        }
    }
}

/* JUNIOR_MEMORY_ENTRY is the answer when there is such a slot. */
uint8_t memory_handle_read(struct junior *junior, const mavlink_junior_memory_read_t *request)
{
    mavlink_junior_memory_entry_t entry;
    struct maneuver_plan plan;
    uint8_t index = request->index;
    uint8_t slot;

    if (index == BY_STIMULI) {
        slot = memory_find(junior, request->previous, request->current);
        for (index = 0; index < junior->memory.used && junior->memory.order[index] != slot; index++) {
        }
    }
    if (index >= junior->memory.used || !memory_plan(junior, junior->memory.order[index], &plan)) {
        return ROBOT_REASON_NOT_FOUND;
    }
    slot = junior->memory.order[index];
    memset(&entry, 0, sizeof entry);
    entry.session = request->session;
    entry.sequence = request->sequence;
    entry.checksum = checksum(junior);
    entry.period = plan.period;
    entry.options = plan.options;
    entry.used = junior->memory.used;
    entry.index = index;
    entry.previous = read(junior, slot, AT_PREVIOUS);
    entry.target_system = junior->robot.session.owner.system;
    entry.target_component = junior->robot.session.owner.component;
    entry.current = read(junior, slot, AT_CURRENT);
    entry.count = plan.count;
    memcpy(entry.actions, plan.actions, MAX_ACTIONS);
    SEND(&junior->robot, JUNIOR_MEMORY_ENTRY, &entry);
    return ANSWER_GIVEN;
}
