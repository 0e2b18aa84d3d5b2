/* Junior's program as an Arduino library: you write the functions of hal.h, and call junior_tick every 5 ms. */
#ifndef JUNIOR_HIL_H
#define JUNIOR_HIL_H

#ifdef __cplusplus
extern "C" {
#endif
#include "core/hal.h"
#include "core/junior.h"
#ifdef __cplusplus
}
#endif

#endif
