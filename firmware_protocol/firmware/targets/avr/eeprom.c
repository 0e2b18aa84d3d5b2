/* The EEPROM: at most one byte in a control period, begun when the period's work is done.
 *
 * A byte takes 3.4 ms, in which the EEPROM can't be read. It is over before the next period's work unless that of this one
 * took more than 1.6 ms, and then the wait is for the rest. A byte that waits to be written is read as if it had been.
 */
#include "drivers.h"
#include "core/hal.h"

static bool running; /* control periods come; while the robot boots, writes wait instead */
static bool waiting;
static uint16_t waiting_address;
static uint8_t waiting_value;

static void settle(void)
{
    while (EECR & (1U << EEPE)) {
    }
}

static void write(uint16_t address, uint8_t value)
{
    settle();
    EEAR = address;
    EEDR = value;
    cli();
    EECR |= 1U << EEMPE;
    EECR |= 1U << EEPE; /* within four cycles */
    sei();
}

uint8_t hal_nvm_read(void *board, uint16_t address)
{
    (void)board;
    if (waiting && waiting_address == address) {
        return waiting_value;
    }
    settle();
    EEAR = address;
    EECR |= 1U << EERE;
    return EEDR;
}

bool hal_nvm_ready(void *board)
{
    (void)board;
    return !waiting;
}

void hal_nvm_write(void *board, uint16_t address, uint8_t value)
{
    (void)board;
    if (!running) {
        write(address, value);
        return;
    }
    waiting_address = address;
    waiting_value = value;
    waiting = true;
}

void eeprom_start(void)
{
    running = true;
}

void eeprom_step(void)
{
    if (waiting) {
        waiting = false;
        write(waiting_address, waiting_value);
    }
}

void eeprom_finish(void)
{
    eeprom_step();
    settle();
}
