/* The hardware, as the core sees it. Every target implements these functions, and those that its role adds; nothing else
 * touches hardware.
 *
 * `board` is the target's own pointer, handed to robot_power_on. Sides: 0 left, 1 right.
 */
#ifndef ROBOT_HAL_H
#define ROBOT_HAL_H

#include <stdbool.h>
#include <stdint.h>

#define HAL_NVM_SIZE 1024U /* bytes of non-volatile memory; a blank byte reads 0xFF */

uint64_t hal_micros(void *board);                 /* time since power-on at which this control period began, us */
uint16_t hal_used(void *board);                   /* time since this control period's work began, us */
uint64_t hal_uid(void *board);                    /* unique id of the board */

uint8_t hal_start(void *board);                   /* start module: 1 go; asked from power-on on */
uint16_t hal_battery(void *board);                /* mV */
bool hal_has_encoders(void *board);
int32_t hal_travel(void *board, uint8_t side);    /* wheel encoder since power-on, um; wraps */

void hal_set_wheels(void *board, int16_t left, int16_t right); /* effort, permille */

int16_t hal_read(void *board);                    /* next byte received, or -1 */
uint16_t hal_write_room(void *board);             /* bytes that hal_write will take now */
void hal_write(void *board, const uint8_t *data, uint8_t length);

/* Called where FIRMWARE_CAN is 1 only. */
struct hal_frame {            /* a data frame of CAN 2.0A; others are the driver's to drop */
    uint16_t identifier;      /* 11 bits */
    uint8_t length;           /* 0..8 */
    uint8_t data[8];
};
bool hal_has_can(void *board);                    /* frames instead of bytes; asked once, at power-on */
bool hal_frame_read(void *board, struct hal_frame *frame); /* next frame received; false: none */
uint16_t hal_frame_room(void *board);             /* frames that hal_frame_write will take now: of 18 in all at least, since
                                                     what has no room for all its frames is not begun */
void hal_frame_write(void *board, const struct hal_frame *frame); /* they leave in this order */

uint8_t hal_nvm_read(void *board, uint16_t address);
bool hal_nvm_ready(void *board);                  /* a write now would not block */
void hal_nvm_write(void *board, uint16_t address, uint8_t value);

void hal_reboot(void *board);                     /* asks for a reset; may return, and is called again */

#endif
