/* The wheels: Timer1's two PWM outputs and the direction pins of a TB6612-style driver.
 *
 * While a PWM input is low the driver shorts the motor, so that no effort is a brake, and speed follows effort. At a reset
 * all pins float and the driver's own pull-downs keep it off.
 */
#include "drivers.h"
#include "core/hal.h"

/* The PWM outputs are where the processor has them: OC1A, OC1B. */
#define AT(name, port, bit, label, use) AT_##name = bit,
enum { BOARD_PINS(AT) PIN_END };
#undef AT
typedef char pwm_is_on_timer_1[(int)AT_LEFT_PWM == PB1 && (int)AT_RIGHT_PWM == PB2 ? 1 : -1];

void drive_start(void)
{
    ICR1 = BOARD_PWM_TOP;
    TCCR1A = 1U << WGM11;
    TCCR1B = 1U << WGM13 | 1U << WGM12 | 1U << CS10; /* fast PWM up to ICR1, no prescaler */
    pin_output_LEFT_PWM();
    pin_output_RIGHT_PWM();
    pin_output_LEFT_IN1();
    pin_output_LEFT_IN2();
    pin_output_RIGHT_IN1();
    pin_output_RIGHT_IN2();
    pin_high_STANDBY();
    pin_output_STANDBY();
}

void drive_off(void)
{
    TCCR1A = 1U << WGM11;
    pin_low_STANDBY();
}

/* Counts that a PWM output is high, less one; an output without effort is not connected at all. */
static uint16_t counts(int16_t effort)
{
    return (uint16_t)((effort < 0 ? -effort : effort) - 1);
}

void hal_set_wheels(void *board, int16_t left, int16_t right)
{
    uint8_t outputs = 1U << WGM11;

    (void)board;
    if (left < 0) {
        pin_low_LEFT_IN1();
        pin_high_LEFT_IN2();
    } else {
        pin_low_LEFT_IN2();
        pin_high_LEFT_IN1();
    }
    if (right < 0) {
        pin_low_RIGHT_IN1();
        pin_high_RIGHT_IN2();
    } else {
        pin_low_RIGHT_IN2();
        pin_high_RIGHT_IN1();
    }
    if (left != 0) {
        OCR1A = counts(left);
        outputs |= 1U << COM1A1;
    }
    if (right != 0) {
        OCR1B = counts(right);
        outputs |= 1U << COM1B1;
    }
    TCCR1A = outputs;
}
