/* The board: an Arduino Nano (ATmega328P, 5 V, 16 MHz) with a TB6612-style motor driver. Every pin and constant is here.
 *
 * Plain C without the processor's own header, so that a program on a PC can include it and wire the same pins.
 */
#ifndef JUNIOR_BOARD_H
#define JUNIOR_BOARD_H

#define F_CPU 16000000UL    /* Hz */
#define BOARD_BAUD 115200UL /* 8 data bits, no parity, 1 stop bit; on the Nano's USB port, too */

/* X(name, port, bit, label on the Nano, what is wired to it) */
#define BOARD_PINS(X) \
    X(ARM_LEFT, D, 2, "D2", "left arm's switch, the other contact to GND") \
    X(ARM_RIGHT, D, 3, "D3", "right arm's switch, the other contact to GND") \
    X(START, D, 4, "D4", "start module, high is go; 10 kohm to GND, also where no module is fitted") \
    X(STANDBY, D, 5, "D5", "driver STBY") \
    X(LEFT_IN1, D, 6, "D6", "driver AIN1") \
    X(LEFT_IN2, D, 7, "D7", "driver AIN2") \
    X(RIGHT_IN1, B, 0, "D8", "driver BIN1") \
    X(LEFT_PWM, B, 1, "D9", "driver PWMA; the left motor is on AO1, AO2") \
    X(RIGHT_PWM, B, 2, "D10", "driver PWMB; the right motor is on BO1, BO2") \
    X(RIGHT_IN2, B, 3, "D11", "driver BIN2")

/* X(name, ADC channel, label on the Nano, what is wired to it), in the order of scanning. 0..5 V are 0..1023 counts. */
#define BOARD_ANALOG(X) \
    X(EYE_LEFT, 0, "A0", "left eye's output") \
    X(EYE_RIGHT, 1, "A1", "right eye's output") \
    X(FLOOR_LEFT, 2, "A2", "left floor sensor's output") \
    X(FLOOR_RIGHT, 3, "A3", "right floor sensor's output") \
    X(BATTERY, 6, "A6", "middle of a divider from the battery to GND: 10 kohm, 10 kohm")

#define BOARD_BATTERY_MV 10000UL /* battery voltage at 1024 counts: twice the reference, as the divider halves it */
#define BOARD_ADC_SAMPLES 2U     /* conversions that are averaged for a reading; a power of two */

#define BOARD_PWM_TOP 999U /* 16 MHz / 1000 = 16 kHz, and a permille of effort is one count */

#define BOARD_RX_SIZE 128U /* bytes, a power of two; a control period brings 58 */
#define BOARD_TX_SIZE 192U /* bytes; the messages that fall due together take 160 */

#define BOARD_STACK_PAINT 0xC5 /* what unused RAM is filled with at a reset, so that the deepest stack can be seen */

#endif
