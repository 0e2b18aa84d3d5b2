/* The hardware that only Junior has; every target of it implements these functions, too (core/hal.h). */
#ifndef JUNIOR_SENSES_H
#define JUNIOR_SENSES_H

#include <stdbool.h>
#include <stdint.h>

uint16_t hal_eye(void *board, uint8_t side);      /* ADC counts 0..1023 */
uint16_t hal_floor(void *board, uint8_t side);    /* ADC counts 0..1023 */
uint8_t hal_arm(void *board, uint8_t side);       /* 1: switch closed, bouncing */
bool hal_has_ground(void *board);
int32_t hal_ground(void *board);                  /* ground odometer since power-on, um, forward positive; wraps */

#endif
