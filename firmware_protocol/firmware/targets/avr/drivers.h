/* What the drivers of the ATmega328P say to each other, and pins by name. */
#ifndef JUNIOR_DRIVERS_H
#define JUNIOR_DRIVERS_H

#include "board.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdbool.h>
#include <stdint.h>

/* pin_high_START(), pin_low_START(), pin_output_START(), pin_read_START() and so on. */
#define PIN_FUNCTIONS(name, port, bit, label, use) \
    static inline void pin_high_##name(void) { PORT##port |= (uint8_t)(1U << (bit)); } \
    static inline void pin_low_##name(void) { PORT##port &= (uint8_t) ~(1U << (bit)); } \
    static inline void pin_output_##name(void) { DDR##port |= (uint8_t)(1U << (bit)); } \
    static inline uint8_t pin_read_##name(void) { return (PIN##port >> (bit)) & 1U; }
BOARD_PINS(PIN_FUNCTIONS)

/* board_junior.c, board_micro.c: what only that role has. */
void board_start(void);

/* analog.c: a scan of all channels; it ends by counting one up. */
extern volatile uint8_t analog_scans;
void analog_start(void);
static inline void analog_scan(void)
{
    ADCSRA |= 1U << ADSC;
}

/* clock.c: control periods. */
void clock_start(void);
void clock_wait(void); /* sleeps until the next control period begins */

/* drive.c */
void drive_start(void);
void drive_off(void);

/* eeprom.c: at most one byte in a control period. */
void eeprom_start(void); /* from here on writes wait for eeprom_step */
void eeprom_step(void);
void eeprom_finish(void);

/* uart.c */
void uart_start(void);
void uart_begin(void); /* a control period begins */

#endif
