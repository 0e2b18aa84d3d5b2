/* A robot's board in simavr, one control period at a time. Ours; compiled against libsimavr-dev where it is wanted.
 *
 * It wires what board.h and board_micro.h say is wired: converter inputs, switches, encoders, the serial line, the motor driver;
 * and adds what simavr leaves out: the time an EEPROM write takes, and the chip's serial number. The firmware is the unmodified
 * ELF.
 */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <simavr/avr_adc.h>
#include <simavr/avr_eeprom.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_time.h>

#include "board.h"
#include "board_micro.h"

enum { /* the ATmega328P's data memory */
    EECR = 0x3F, EEARL = 0x41, SPMCSR = 0x57, TCCR1A = 0x80, TCCR1B = 0x81, ICR1 = 0x86,
    OCR1A = 0x88, OCR1B = 0x8A, UCSR0A = 0xC0, UBRR0 = 0xC4,
};
enum { EEPE = 2, EEMPE = 4, SIGNATURE = 0x21, COM1A1 = 0x80, COM1B1 = 0x20, WGM_1A = 0x02, WGM_1B = 0x18, CLOCK_1 = 1, U2X = 2 };
enum { SERIAL_AT = 0x0E, SERIAL_SIZE = 10, MILLIVOLT = 5000, GREATEST = 1023, LINE_SIZE = 256, BITS = 11 /* as simavr counts */ };
enum { PERIOD_US = 5000, EEPROM_US = 3400, BOOT_LIMIT_US = 1000000, NVM_SIZE = 1024 };
enum { TURN_US = 800 /* less than a scan of the converter takes */, LEFT = 0, RIGHT = 1, SIDES = 2 };

#define CHANNEL(name, channel, label, use) channel,
static const uint8_t channels[] = {BOARD_ANALOG(CHANNEL)};
#undef CHANNEL
enum { CHANNELS = sizeof channels };

typedef struct {
    uint16_t counts[CHANNELS]; /* what the converter is to read, in the order of board.h */
    uint8_t closed[2];         /* arm switches, left right; a micro-robot has its bumpers on the same pins */
    int16_t turned[2];         /* changes of the wheel encoders' outputs, left right, forward positive; 40 a period at most */
    uint8_t start;             /* start module: 1 go */
    int16_t wheel[2];          /* OUT: effort that the driver gives the motors, permille */
    uint8_t reset;             /* OUT: the watchdog has reset the processor; run no further than avr_board_boot */
    uint32_t busy;             /* OUT: cycles in which the processor did not sleep, in the last period */
    uint32_t taken;            /* OUT: bytes of the last period's rx that the line has accepted; the rest is to be offered again */
    uint32_t tx_len;           /* OUT */
    uint8_t tx[1024];          /* OUT: bytes sent in the last period */
} avr_io;

typedef struct avr_board {
    avr_io io;
    avr_t *avr;
    elf_firmware_t firmware;
    void (*reset)(struct avr_t *);
    avr_irq_t *analog, *input;
    uint8_t serial[SERIAL_SIZE], covered[SERIAL_SIZE];
    uint8_t line[LINE_SIZE];                 /* bytes on their way to the processor */
    uint32_t line_out, line_used;
    avr_cycle_count_t line_free, end, slept; /* cycles */
    avr_cycle_count_t writing_until;         /* the EEPROM is busy */
    uint16_t writing;                        /* with this byte */
    uint8_t armed, asleep;
    int16_t turns, turn;                     /* steps in which the wheels turn in this period, and those that are done */
    int16_t shown[SIDES];                    /* changes of this period that the encoders have shown */
    uint8_t phase[SIDES];                    /* the encoders' place, 0..3 */
} avr_board;

struct pin {
    char port;
    uint8_t bit;
};
#define PIN(name, port, bit, label, use) static const struct pin name = {#port[0], bit};
BOARD_PINS(PIN)
BOARD_MICRO_PINS(PIN)
#undef PIN

static const struct pin *const encoders[SIDES][2] = {{&LEFT_A, &LEFT_B}, {&RIGHT_A, &RIGHT_B}};

static uint8_t *pin_register(avr_board *board, char port) /* PIN; DDR and PORT follow */
{
    return board->avr->data + 0x23 + 3 * (port - 'B');
}

static int driven(avr_board *board, struct pin pin) /* an output's level; what floats is pulled low by the driver */
{
    const uint8_t *io = pin_register(board, pin.port);

    return (io[1] & io[2]) >> pin.bit & 1;
}

/* A pin that something outside drives, or that only its pull-up does. */
static void drive(avr_board *board, struct pin pin, int outside, int level)
{
    uint8_t *io = pin_register(board, pin.port);
    uint8_t mask = (uint8_t)(1 << pin.bit);

    if (!outside) {
        level = (io[2] & mask) != 0;
    }
    io[0] = (uint8_t)(level ? io[0] | mask : io[0] & ~mask);
}

/* Forward, output A changes before B. */
static int encoder_level(const avr_board *board, int side, int output)
{
    return ((output == 0 ? board->phase[side] + 1 : board->phase[side]) >> 1) & 1;
}

static void set_encoders(avr_board *board)
{
    avr_ioport_external_t port = {.name = LEFT_A.port};
    int side, output;

    for (side = 0; side < SIDES; side++) {
        for (output = 0; output < 2; output++) {
            const struct pin *pin = encoders[side][output];

            drive(board, *pin, 1, encoder_level(board, side, output));
            port.mask |= (uint8_t)(1 << pin->bit);
            port.value |= (uint8_t)(encoder_level(board, side, output) << pin->bit);
        }
    }
    avr_ioctl(board->avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(LEFT_A.port), &port); /* or a write to the port loses the levels */
}

/* The wheels turn by one step: at most one output of each encoder changes. */
static avr_cycle_count_t on_turn(struct avr_t *avr, avr_cycle_count_t when, void *param)
{
    avr_board *board = param;
    int side, output;

    board->turn++;
    for (side = 0; side < SIDES; side++) {
        int to = board->io.turned[side] * board->turn / board->turns;

        board->phase[side] = (uint8_t)(board->phase[side] + to - board->shown[side]) & 3;
        board->shown[side] = (int16_t)to;
        for (output = 0; output < 2; output++) {
            const struct pin *pin = encoders[side][output];
            int level = encoder_level(board, side, output);

            if ((pin_register(board, pin->port)[0] >> pin->bit & 1) != level) { /* with the interrupt of a pin that changes */
                avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(pin->port), pin->bit), (uint32_t)level);
            }
        }
    }
    return board->turn < board->turns ? when + avr_usec_to_cycles(avr, TURN_US) / (avr_cycle_count_t)board->turns : 0;
}

/* What the wheels turned in the world's last step is shown before this period's work begins, at an even pace. */
static void turn_wheels(avr_board *board)
{
    int left = abs(board->io.turned[LEFT]), right = abs(board->io.turned[RIGHT]);

    set_encoders(board);
    memset(board->shown, 0, sizeof board->shown);
    board->turn = 0;
    board->turns = (int16_t)(left > right ? left : right);
    if (board->turns > 0) {
        avr_cycle_timer_register(board->avr, avr_usec_to_cycles(board->avr, TURN_US) / (avr_cycle_count_t)board->turns, on_turn, board);
    }
}

static void set_inputs(avr_board *board)
{
    avr_ioport_external_t port = {.name = START.port};
    const struct pin *arms[2] = {&ARM_LEFT, &ARM_RIGHT};
    int i;

    for (i = 0; i < CHANNELS; i++) { /* the least voltage that reads so */
        avr_raise_irq(board->analog + channels[i], (board->io.counts[i] * (uint32_t)MILLIVOLT + GREATEST - 1) / GREATEST);
    }
    for (i = 0; i < 2; i++) {
        drive(board, *arms[i], board->io.closed[i], 0);
        if (board->io.closed[i]) {
            port.mask |= (uint8_t)(1 << arms[i]->bit);
        }
    }
    drive(board, START, 1, board->io.start);
    port.mask |= (uint8_t)(1 << START.bit);
    port.value = (uint8_t)(board->io.start ? 1 << START.bit : 0);
    avr_ioctl(board->avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(START.port), &port); /* or a write to the port loses the levels */
}

static int word(avr_board *board, int address)
{
    return board->avr->data[address] | board->avr->data[address + 1] << 8;
}

/* What the driver makes of its inputs: nothing in standby or with both direction inputs alike. */
static int16_t effort(avr_board *board, int connected, int compare, struct pin pwm, struct pin one, struct pin two)
{
    const uint8_t *data = board->avr->data;
    int high = driven(board, pwm) ? 1000 : 0, direction = driven(board, one) - driven(board, two);

    if (!driven(board, STANDBY)) {
        return 0;
    }
    if (data[TCCR1A] & connected) {
        int fast = (data[TCCR1A] & 3) == WGM_1A && (data[TCCR1B] & WGM_1B) == WGM_1B && (data[TCCR1B] & 7) == CLOCK_1;
        int enabled = pin_register(board, pwm.port)[1] >> pwm.bit & 1;

        high = fast && enabled ? (2000 * (word(board, compare) + 1) + word(board, ICR1) + 1) / (2 * (word(board, ICR1) + 1)) : 0;
    }
    return (int16_t)(direction * (high > 1000 ? 1000 : high));
}

static void on_output(struct avr_irq_t *irq, uint32_t value, void *param)
{
    avr_board *board = param;

    (void)irq;
    if (board->io.tx_len < sizeof board->io.tx) {
        board->io.tx[board->io.tx_len++] = (uint8_t)value;
    }
}

static avr_cycle_count_t byte_cycles(avr_board *board)
{
    return (avr_cycle_count_t)(word(board, UBRR0) + 1) * (board->avr->data[UCSR0A] & U2X ? 8 : 16) * BITS;
}

/* The next byte sets out on the line. */
static avr_cycle_count_t on_line(struct avr_t *avr, avr_cycle_count_t when, void *param)
{
    avr_board *board = param;

    (void)avr;
    avr_raise_irq(board->input, board->line[board->line_out]);
    board->line_out = (board->line_out + 1) % LINE_SIZE;
    board->line_used--;
    board->line_free = when + byte_cycles(board);
    return board->line_used > 0 ? board->line_free : 0;
}

static avr_cycle_count_t on_nothing(struct avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)avr;
    (void)when;
    (void)param;
    return 0;
}

static avr_cycle_count_t on_written(struct avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)when;
    (void)param;
    avr->data[EECR] &= (uint8_t)~EEPE;
    return 0;
}

/* After simavr's own handler, for which a byte is written at once. */
static void on_eecr(struct avr_t *avr, avr_io_addr_t address, uint8_t value, void *param)
{
    avr_board *board = param;

    (void)address;
    if (board->armed && (value & (EEPE | EEMPE)) == (EEPE | EEMPE)) {
        board->writing = (uint16_t)word(board, EEARL) % NVM_SIZE;
        board->writing_until = avr->cycle + avr_usec_to_cycles(avr, EEPROM_US);
        avr_cycle_timer_register_usec(avr, EEPROM_US, on_written, board);
    }
    board->armed = (value & EEMPE) != 0;
    if (avr->cycle < board->writing_until) {
        avr->data[EECR] |= EEPE;
    }
}

static avr_cycle_count_t on_uncover(struct avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)when;
    memcpy(avr->flash + SERIAL_AT, ((avr_board *)param)->covered, SERIAL_SIZE);
    return 0;
}

/* The signature row shows through flash for the few cycles in which it can be read. */
static void on_spmcsr(struct avr_t *avr, avr_io_addr_t address, uint8_t value, void *param)
{
    avr_board *board = param;

    (void)address;
    if ((value & SIGNATURE) == SIGNATURE) {
        memcpy(avr->flash + SERIAL_AT, board->serial, SERIAL_SIZE);
        avr_cycle_timer_register(avr, 5, on_uncover, board);
    }
}

static void on_sleep(struct avr_t *avr, avr_cycle_count_t cycles)
{
    avr_board *board = avr->custom.data;

    board->asleep = 1;
    board->slept += cycles + 1;
}

static void on_reset(struct avr_t *avr)
{
    avr_board *board = avr->custom.data;

    board->io.reset = 1;
    if (board->reset) {
        board->reset(avr);
    }
}

static void on_log(struct avr_t *avr, const int level, const char *format, va_list arguments)
{
    (void)avr;
    (void)level;
    (void)format;
    (void)arguments;
}

void avr_board_free(avr_board *board)
{
    if (board->avr) {
        avr_terminate(board->avr);
        free(board->avr);
    }
    free(board);
}

/* A board with this firmware; NULL: simavr can't read it, or does not know the processor. */
avr_board *avr_board_new(const char *elf, uint64_t uid)
{
    avr_board *board = calloc(1, sizeof *board);
    uint32_t flags = 0;
    avr_t *avr;

    avr_global_logger_set(on_log);
    if (!board || elf_read_firmware(elf, &board->firmware) != 0 || !(avr = avr_make_mcu_by_name("atmega328p"))) {
        free(board);
        return NULL;
    }
    avr_init(avr);
    strcpy(board->firmware.mmcu, "atmega328p");
    board->firmware.frequency = F_CPU;
    board->firmware.vcc = board->firmware.avcc = board->firmware.aref = MILLIVOLT;
    avr_load_firmware(avr, &board->firmware);
    board->avr = avr;
    board->reset = avr->reset;
    avr->custom.data = board;
    avr->reset = on_reset;
    avr->sleep = on_sleep; /* simavr's own follows the wall clock */
    memcpy(board->serial, &uid, sizeof uid);
    memcpy(board->covered, avr->flash + SERIAL_AT, SERIAL_SIZE);
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags); /* no printing, no waiting */
    board->input = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    board->analog = avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, 0);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_output, board);
    avr_register_io_write(avr, EECR, on_eecr, board);
    avr_register_io_write(avr, SPMCSR, on_spmcsr, board);
    return board;
}

/* What the other side takes for an avr_io must be as large, and this file the one that it has read. */
uint32_t avr_board_io_size(void)
{
    return sizeof(avr_io);
}

uint64_t avr_board_built_from(void)
{
    return SHIM_HASH;
}

avr_io *avr_board_io(avr_board *board)
{
    return &board->io;
}

/* The EEPROM: NVM_SIZE bytes. */
uint8_t *avr_board_nvm(avr_board *board)
{
    avr_eeprom_desc_t all = {.size = NVM_SIZE};

    avr_ioctl(board->avr, AVR_IOCTL_EEPROM_GET, &all);
    return all.ee;
}

/* Data memory, and where a variable lies in it; 0: there is no such variable. */
uint8_t *avr_board_memory(avr_board *board)
{
    return board->avr->data;
}

uint16_t avr_board_address(avr_board *board, const char *name)
{
    uint32_t i;

    for (i = 0; i < board->firmware.symbolcount; i++) {
        if (strcmp(board->firmware.symbol[i]->symbol, name) == 0) {
            return (uint16_t)board->firmware.symbol[i]->addr;
        }
    }
    return 0;
}

/* One instruction, or a sleep. False: the processor has crashed. */
static int advance(avr_board *board)
{
    int state = avr_run(board->avr);

    return state == cpu_Running || state == cpu_Sleeping;
}

/* Runs up to that cycle, or to a reset by the watchdog, which also forgets all timers. False: the processor has crashed. */
static int run(avr_board *board, avr_cycle_count_t end)
{
    avr_t *avr = board->avr;
    int alive = 1;

    if (end > avr->cycle) {
        avr_cycle_timer_register(avr, end - avr->cycle, on_nothing, board); /* sleep no longer than that */
    }
    while (alive && avr->cycle < end && !board->io.reset) {
        alive = advance(board);
    }
    return alive;
}

/* Cuts the power and gives it back: all is lost but the EEPROM, in which a byte that was being written becomes `torn`
 * (negative: it is whole). */
void avr_board_cut(avr_board *board, int torn)
{
    avr_t *avr = board->avr;

    if (torn >= 0 && avr->cycle < board->writing_until) {
        avr_board_nvm(board)[board->writing] = (uint8_t)torn;
    }
    memcpy(avr->flash + SERIAL_AT, board->covered, SERIAL_SIZE);
    if (avr->run != avr_callback_run_raw) {
        avr_run(avr); /* the watchdog had bitten in this very cycle */
    }
    avr_reset(avr);
    avr->data[0x54] = 1; /* MCUSR: power-on */
    avr->state = cpu_Running;
    board->io.reset = board->asleep = board->armed = 0; /* this reset is no watchdog's */
    board->line_used = 0;
    board->writing_until = 0;
    memset(&board->io.wheel, 0, sizeof board->io.wheel);
}

/* Boots after a cut or a reset: runs until the first control period is due. False: the firmware does not come up. */
int avr_board_boot(avr_board *board)
{
    avr_t *avr = board->avr;
    avr_cycle_count_t limit = avr->cycle + avr_usec_to_cycles(avr, BOOT_LIMIT_US);

    avr->state = cpu_Running;
    board->io.reset = board->asleep = board->armed = 0;
    board->line_used = 0;
    set_inputs(board);
    set_encoders(board);
    while (!board->asleep && avr->cycle < limit) {
        if (!advance(board) || board->io.reset) {
            return 0;
        }
    }
    board->io.tx_len = 0;
    board->end = avr->cycle;
    return board->asleep;
}

/* Part of a control period, or a few: for whoever wants to cut the power in the midst of one. */
int avr_board_run(avr_board *board, uint32_t cycles)
{
    set_inputs(board);
    return run(board, board->avr->cycle + cycles);
}

/* One control period, in which these bytes set out. False: the processor has crashed. */
int avr_board_step(avr_board *board, const uint8_t *rx, uint32_t length)
{
    avr_t *avr = board->avr;
    avr_io *io = &board->io;
    int alive;

    set_inputs(board);
    turn_wheels(board);
    for (io->taken = 0; io->taken < length && board->line_used < LINE_SIZE; io->taken++) {
        board->line[(board->line_out + board->line_used++) % LINE_SIZE] = rx[io->taken];
    }
    if (board->line_used > 0 && avr_cycle_timer_status(avr, on_line, board) == 0) {
        avr_cycle_count_t begin = board->line_free > avr->cycle ? board->line_free : avr->cycle + 1;
        avr_cycle_timer_register(avr, begin - avr->cycle, on_line, board);
    }
    io->tx_len = 0;
    board->slept = 0;
    board->end += avr_usec_to_cycles(avr, PERIOD_US);
    alive = run(board, board->end);
    io->busy = (uint32_t)(avr_usec_to_cycles(avr, PERIOD_US) - board->slept);
    io->wheel[0] = effort(board, COM1A1, OCR1A, LEFT_PWM, LEFT_IN1, LEFT_IN2);
    io->wheel[1] = effort(board, COM1B1, OCR1B, RIGHT_PWM, RIGHT_IN1, RIGHT_IN2);
    return alive;
}
