/* Non-volatile memory that survives a power cut at any byte.
 *
 * Writes go through one small job, a byte whenever the hardware is ready (an EEPROM takes 3.4 ms a byte; the wheels
 * must not wait for it). The last byte of what is written is its mark: it is blanked first and set last, and what has a
 * blank mark is not there. A record is four bytes kept twice: value, checksum, and as the mark a turn number 0..2 that
 * tells which copy is newer. The older copy is the one that is overwritten: a cut leaves the old value or the new one.
 * The turn is in the checksum, because a byte that is torn itself may read as anything.
 */
#include "core/core.h"

enum { COPY_SIZE = 7, AT_CRC = 4, AT_TURN = 6, TURNS = 3, BLANK = 0xFF };

/* Records don't meet what is a role's. */
typedef char nvm_fits[(RECORD_PARAMS + PARAMS_MOST) * RECORD_SIZE <= NVM_ROLE_ADDRESS ? 1 : -1];

bool nvm_idle(const struct robot *robot)
{
    return !robot->nvm.busy;
}

void nvm_begin(struct robot *robot, uint16_t address, uint8_t length)
{
    robot->nvm.address = address;
    robot->nvm.length = length;
    robot->nvm.position = 0;
    robot->nvm.busy = true;
    nvm_step(robot);
}

void nvm_step(struct robot *robot)
{
    struct nvm *nvm = &robot->nvm;

    while (nvm->busy && hal_nvm_ready(robot->board)) {
        uint16_t address = nvm->address;
        uint8_t value = BLANK;

        if (nvm->position == 0) {
            address = (uint16_t)(address + nvm->length - 1); /* the mark: not valid from here on */
        } else {
            address = (uint16_t)(address + nvm->position - 1);
            value = nvm->data[nvm->position - 1];
        }
        if (hal_nvm_read(robot->board, address) != value) {
            hal_nvm_write(robot->board, address, value);
        }
        nvm->busy = nvm->position++ < nvm->length;
    }
}

/* At boot nothing else goes on: wait for it. */
void nvm_flush(struct robot *robot)
{
    while (robot->nvm.busy) {
        nvm_step(robot); /* unreachable: on the host memory is ready at once while it boots; an EEPROM is not */
    }
}

static uint16_t copy_address(uint8_t index, uint8_t copy)
{
    return (uint16_t)(index * RECORD_SIZE + copy * COPY_SIZE);
}

static uint16_t crc_of(const uint8_t value[4], uint8_t turn, uint16_t seed)
{
    uint8_t i;

    for (i = 0; i < 4; i++) {
        seed = wire_crc(seed, value[i]);
    }
    return wire_crc(seed, turn);
}

static uint8_t read_copy(struct robot *robot, uint16_t address, uint16_t seed, uint8_t value[4], uint8_t *turn)
{
    uint8_t i;
    uint16_t crc;

    for (i = 0; i < 4; i++) {
        value[i] = hal_nvm_read(robot->board, (uint16_t)(address + i));
    }
    crc = (uint16_t)(hal_nvm_read(robot->board, (uint16_t)(address + AT_CRC))
                     | (uint16_t)hal_nvm_read(robot->board, (uint16_t)(address + AT_CRC + 1)) << 8);
    *turn = hal_nvm_read(robot->board, (uint16_t)(address + AT_TURN));
    if (*turn == BLANK) {
        return RECORD_BLANK; /* never written, or being written when the power went */
    }
    return *turn < TURNS && crc == crc_of(value, *turn, seed) ? RECORD_GOOD : RECORD_SPOILT;
}

/* The copy that holds: 0 or 1; *state says whether any does. */
static uint8_t newest_copy(struct robot *robot, uint8_t index, uint16_t seed, uint8_t value[4], uint8_t *turn,
                           uint8_t *state)
{
    uint8_t other[4], other_turn, other_state;

    *state = read_copy(robot, copy_address(index, 0), seed, value, turn);
    other_state = read_copy(robot, copy_address(index, 1), seed, other, &other_turn);
    if (other_state == RECORD_GOOD && (*state != RECORD_GOOD || other_turn == (*turn + 1) % TURNS)) {
        memcpy(value, other, 4);
        *turn = other_turn;
        *state = RECORD_GOOD;
        return 1;
    }
    if (other_state == RECORD_SPOILT && *state == RECORD_BLANK) {
        *state = RECORD_SPOILT;
    }
    return 0;
}

uint8_t nvm_record_read(struct robot *robot, uint8_t index, uint16_t seed, uint8_t value[4])
{
    uint8_t turn, state;

    newest_copy(robot, index, seed, value, &turn, &state);
    return state;
}

/* The caller has seen that no job is under way. */
void nvm_record_write(struct robot *robot, uint8_t index, uint16_t seed, const uint8_t value[4])
{
    uint8_t present[4], turn, state, copy;
    uint8_t *data = robot->nvm.data;
    uint16_t crc;

    copy = newest_copy(robot, index, seed, present, &turn, &state);
    if (state == RECORD_GOOD) {
        if (memcmp(present, value, 4) == 0) {
            return;
        }
        copy ^= 1;
        turn = (uint8_t)((turn + 1) % TURNS);
    } else {
        turn = 0;
    }
    crc = crc_of(value, turn, seed);
    memcpy(data, value, 4);
    data[AT_CRC] = (uint8_t)crc;
    data[AT_CRC + 1] = (uint8_t)(crc >> 8);
    data[AT_TURN] = turn;
    nvm_begin(robot, copy_address(index, copy), COPY_SIZE);
}
