/* Robots that run the firmware, as arrays: what their drivers read and set, and no world around them. */
#ifndef KERNEL_DEVICES_H
#define KERNEL_DEVICES_H

#include "host.h"

typedef struct {
    uint32_t period_us, system_at; /* where a frame carries the sender's system id, ... */
    uint8_t system_mask;           /* ... and which bits of that byte are the id */
    host_robot **robot;
    uint64_t *micros;      /* since power-on */
    const uint8_t **rx;    /* what arrives in the next period */
    uint32_t *rx_len;
    uint8_t *fresh;        /* it has sent nothing since it booted */
    uint8_t *system;       /* id that it uses on the wire, as its frames say */
    uint8_t *running;      /* it is there, and switched on */
    uint8_t *dark;         /* its power has failed */
    double *effort;        /* share of a commanded effort that reaches the motor; left, right */
    uint8_t *stuck;        /* for each sensor, eyes, floor, arms, 1: it reads what it has read last */
    uint16_t *reading;     /* for each sensor, what the drivers read last */
} kernel_devices;

/* What the drivers read of a robot's sensors, those that are stuck apart. Each argument: left, right. */
void devices_read(kernel_devices *devices, uint32_t device, const uint16_t *eye, const uint16_t *floor, const uint8_t *arm);

/* What they read of battery (V), wheel encoders (left, right) and ground odometer (m). */
void devices_measure(kernel_devices *devices, uint32_t device, double voltage, const double *travel, double ground);

/* One tick of the firmware. wheels: what reaches the motors, in permille, left and right. Returns 1 where it has asked for
 * a reset: it has booted by then, and what it had sent before is still in its tx. */
uint8_t devices_tick(kernel_devices *devices, uint32_t device, int16_t *wheels);

#endif
