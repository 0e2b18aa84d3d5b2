/* Constant tables: on AVR they live in flash and need special reads, elsewhere they are ordinary constants. */
#ifndef ROBOT_FLASH_H
#define ROBOT_FLASH_H

#include <stdint.h>
#include <string.h>

#ifdef __AVR__
#include <avr/pgmspace.h>
#define HAL_FLASH PROGMEM
#define flash_u8(address) pgm_read_byte(address)
#define flash_u16(address) pgm_read_word(address)
#define flash_u32(address) pgm_read_dword(address)
#define flash_float(address) pgm_read_float(address)
#define flash_copy(to, from, length) memcpy_P((to), (from), (length))
#else
#define HAL_FLASH
#define flash_u8(address) (*(const uint8_t *)(address))
#define flash_u16(address) (*(const uint16_t *)(address))
#define flash_u32(address) (*(const uint32_t *)(address))
#define flash_float(address) (*(const float *)(address))
#define flash_copy(to, from, length) memcpy((to), (from), (length))
#endif

#endif
