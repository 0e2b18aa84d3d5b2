/* Junior's program as an Arduino library: you write the functions of hal.h and senses.h, and call robot_tick every 5 ms. */
#ifndef JUNIOR_HIL_H
#define JUNIOR_HIL_H

#ifdef __cplusplus
extern "C" {
#endif
#include "core/hal.h"
#include "junior/junior.h"
#include "junior/senses.h"
#ifdef __cplusplus
}
#endif

#endif
