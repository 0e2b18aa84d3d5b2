/* Control periods of 5 ms: Timer0 counts milliseconds and starts a scan of the sensors; the period's work begins when that
 * is done, and its time is that of the timer. Nothing but two small counters is shared with interrupts.
 */
#include "drivers.h"
#include "core/hal.h"
#include "core/robot.h"

#include <avr/sleep.h>

enum { COUNTS_PER_MS = F_CPU / 64UL / 1000UL, US_PER_COUNT = 4, US_PER_MS = 1000, PERIOD_US = TICK_MS * US_PER_MS };

static volatile uint8_t now_ms;
static volatile uint8_t left = 1; /* ms until the next period; the first one begins at once */
static uint8_t seen;              /* scans */
static uint8_t begun_ms, begun_count;
static uint64_t micros;

ISR(TIMER0_COMPA_vect)
{
    uint8_t rest = (uint8_t)(left - 1U);

    now_ms++;
    if (rest == 0) {
        rest = TICK_MS;
        analog_scan();
    }
    left = rest;
}

void clock_start(void)
{
    OCR0A = COUNTS_PER_MS - 1;
    TCNT0 = COUNTS_PER_MS - 2;
    TCCR0A = 1U << WGM01;
    TIMSK0 = 1U << OCIE0A;
    TCCR0B = 1U << CS01 | 1U << CS00; /* 16 MHz / 64 */
    set_sleep_mode(SLEEP_MODE_IDLE);
    micros = (uint64_t)0 - PERIOD_US; /* the first period is at 0 */
}

/* With interrupts off. */
static void read_timer(uint8_t *ms, uint8_t *count)
{
    *count = TCNT0;
    *ms = now_ms;
    if (TIFR0 & (1U << OCF0A) && *count < COUNTS_PER_MS / 2) {
        (*ms)++; /* it has just passed; nobody has counted it yet */
    }
}

void clock_wait(void)
{
    uint8_t scans;

    cli();
    while ((scans = analog_scans) == seen) {
        sleep_enable();
        sei();
        sleep_cpu();
        sleep_disable();
        cli();
    }
    read_timer(&begun_ms, &begun_count);
    sei();
    micros += (uint32_t)(uint8_t)(scans - seen) * PERIOD_US;
    seen = scans;
}

uint64_t hal_micros(void *board)
{
    (void)board;
    return micros;
}

uint16_t hal_used(void *board)
{
    uint8_t ms, count;

    (void)board;
    cli();
    read_timer(&ms, &count);
    sei();
    return (uint16_t)((uint8_t)(ms - begun_ms) * US_PER_MS + ((int16_t)count - begun_count) * US_PER_COUNT);
}
