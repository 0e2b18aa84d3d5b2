/* A robot on an ATmega328P: what little there is to the board itself, whatever the role, and its main loop.
 *
 * Interrupt handlers only move bytes and count; the robot is main's alone.
 */
#include <avr/boot.h>
#include <avr/wdt.h>
#include <string.h>

#include "drivers.h"
#include "core/hal.h"

/* The header of the role that is built, and its struct: "junior/junior.h", struct junior. */
#define TEXT(tokens) #tokens
#define TEXT_OF(tokens) TEXT(tokens)
#include TEXT_OF(ROLE/ROLE.h)

enum { SERIAL_AT = 0x0E, SERIAL_SIZE = 10 };

static struct ROLE robot;

/* The ten bytes after the calibration byte are the lot, the wafer and the place on it. */
uint64_t hal_uid(void *board)
{
    uint8_t bytes[sizeof(uint64_t)] = {0};
    uint64_t uid;
    uint8_t i;

    (void)board;
    for (i = 0; i < SERIAL_SIZE; i++) {
        cli();
        bytes[i % sizeof bytes] ^= boot_signature_byte_get(SERIAL_AT + i);
        sei();
    }
    memcpy(&uid, bytes, sizeof uid);
    return uid;
}

uint8_t hal_start(void *board)
{
    (void)board;
    return pin_read_START();
}

/* A real reset: everything floats, and all begins anew. */
void hal_reboot(void *board)
{
    (void)board;
    drive_off();
    eeprom_finish();
    wdt_enable(WDTO_15MS);
    wdt_reset(); /* 15 ms from here, not the rest of the time before */
    for (;;) {
    }
}

int main(void)
{
    wdt_enable(WDTO_120MS); /* fed by the loop alone; booting takes 30 ms, most of it to store the count of boots */
    board_start();
    drive_start();
    uart_start();
    analog_start();
    sei();
    robot_power_on(&robot.robot, 0);
    eeprom_start();
    clock_start();
    for (;;) {
        clock_wait();
        wdt_reset();
        uart_begin();
        robot_tick(&robot.robot);
        eeprom_step();
    }
}
