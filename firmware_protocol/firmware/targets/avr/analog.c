/* The converter: one scan of all channels at the beginning of a control period, by interrupts; 0.1 ms a conversion. */
#include "drivers.h"
#include "core/hal.h"
#include "junior/senses.h"

#define CHANNEL(name, channel, label, use) CHANNEL_##name,
enum { BOARD_ANALOG(CHANNEL) CHANNELS };
#undef CHANNEL

#define MUX(name, channel, label, use) 1U << REFS0 | (channel), /* reference: the 5 V supply */
static const uint8_t mux[CHANNELS] = {BOARD_ANALOG(MUX)};
#undef MUX

typedef char samples_are_a_power_of_two[(BOARD_ADC_SAMPLES & (BOARD_ADC_SAMPLES - 1U)) == 0 && BOARD_ADC_SAMPLES <= 64U ? 1 : -1];

volatile uint8_t analog_scans;
static volatile uint16_t reading[CHANNELS];

void analog_start(void)
{
    ADMUX = mux[0];
    ADCSRA = 1U << ADEN | 1U << ADIE | 7U << ADPS0; /* 125 kHz: 10 bits need less than 200 kHz */
}

ISR(ADC_vect)
{
    static uint16_t sum;
    static uint8_t samples, channel;

    sum += ADC;
    if (++samples == BOARD_ADC_SAMPLES) {
        reading[channel] = sum / BOARD_ADC_SAMPLES;
        sum = 0;
        samples = 0;
        channel++;
        if (channel == CHANNELS) {
            channel = 0;
        }
        ADMUX = mux[channel];
        if (channel == 0) {
            analog_scans++;
            return;
        }
    }
    analog_scan();
}

/* No scan is under way while a control period is worked on, unless it is worked on for too long. */
static uint16_t read(uint8_t channel)
{
    uint16_t value;

    cli();
    value = reading[channel];
    sei();
    return value;
}

uint16_t hal_eye(void *board, uint8_t side)
{
    (void)board;
    return read((uint8_t)(CHANNEL_EYE_LEFT + side));
}

uint16_t hal_floor(void *board, uint8_t side)
{
    (void)board;
    return read((uint8_t)(CHANNEL_FLOOR_LEFT + side));
}

uint16_t hal_battery(void *board)
{
    (void)board;
    return (uint16_t)(read(CHANNEL_BATTERY) * BOARD_BATTERY_MV / 1024U);
}
