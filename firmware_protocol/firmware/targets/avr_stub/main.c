/* ATmega328P with drivers that drive nothing: shows that the core compiles, links and fits.
 *
 * The buffers are as large as real drivers need them: a line at 115200 baud brings 58 bytes a control period, and the
 * largest message of a robot takes 133.
 */
#include <avr/eeprom.h>
#include <avr/io.h>

#include "hal.h"
#include "junior.h"

enum { RX_SIZE = 128, TX_SIZE = 192 };

static struct junior robot;
static volatile uint32_t micros_now;
static volatile uint8_t rx[RX_SIZE], rx_in;
static uint8_t rx_out;
static volatile uint8_t tx[TX_SIZE], tx_out;
static uint8_t tx_in;
static volatile uint16_t adc[5];
static volatile int16_t wheel[2];

uint64_t hal_micros(void *board)
{
    static uint32_t high, before;
    uint32_t now = micros_now;

    (void)board;
    if (now < before) {
        high++;
    }
    before = now;
    return (uint64_t)high << 32 | now;
}

uint64_t hal_uid(void *board)
{
    (void)board;
    return 0;
}

uint16_t hal_eye(void *board, uint8_t side)
{
    (void)board;
    return adc[side];
}

uint16_t hal_floor(void *board, uint8_t side)
{
    (void)board;
    return adc[2 + side];
}

uint8_t hal_arm(void *board, uint8_t side)
{
    (void)board;
    return !(PIND & (1 << (2 + side)));
}

uint8_t hal_start(void *board)
{
    (void)board;
    return !(PIND & (1 << 4));
}

uint16_t hal_battery(void *board)
{
    (void)board;
    return adc[4];
}

bool hal_has_encoders(void *board)
{
    (void)board;
    return false;
}

bool hal_has_ground(void *board)
{
    (void)board;
    return false;
}

int32_t hal_travel(void *board, uint8_t side)
{
    (void)board;
    (void)side;
    return 0;
}

int32_t hal_ground(void *board)
{
    (void)board;
    return 0;
}

void hal_set_wheels(void *board, int16_t left, int16_t right)
{
    (void)board;
    wheel[0] = left;
    wheel[1] = right;
}

int16_t hal_read(void *board)
{
    int16_t byte;

    (void)board;
    if (rx_out == rx_in) {
        return -1;
    }
    byte = rx[rx_out];
    rx_out = (uint8_t)((rx_out + 1) % RX_SIZE);
    return byte;
}

uint16_t hal_write_room(void *board)
{
    (void)board;
    return (uint16_t)((tx_out + TX_SIZE - tx_in - 1) % TX_SIZE);
}

void hal_write(void *board, const uint8_t *data, uint8_t length)
{
    (void)board;
    while (length-- > 0) {
        tx[tx_in] = *data++;
        tx_in = (uint8_t)((tx_in + 1) % TX_SIZE);
    }
}

uint8_t hal_nvm_read(void *board, uint16_t address)
{
    (void)board;
    return eeprom_read_byte((const uint8_t *)address);
}

bool hal_nvm_ready(void *board)
{
    (void)board;
    return eeprom_is_ready();
}

void hal_nvm_write(void *board, uint16_t address, uint8_t value)
{
    (void)board;
    eeprom_update_byte((uint8_t *)address, value);
}

void hal_reboot(void *board)
{
    (void)board;
    WDTCSR = 1 << WDE;
}

int main(void)
{
    junior_power_on(&robot, 0);
    for (;;) {
        uint32_t begun = micros_now;

        junior_tick(&robot);
        while (micros_now - begun < TICK_MS * 1000UL) {
        }
    }
}
