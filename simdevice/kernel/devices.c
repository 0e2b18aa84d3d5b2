#include "devices.h"

#include <math.h>

enum { EYES = 0, FLOOR = 2, ARMS = 4, SENSORS = 6 };

void devices_read(kernel_devices *devices, uint32_t device, const uint16_t *eye, const uint16_t *floor, const uint8_t *arm)
{
    const uint8_t *stuck = &devices->stuck[SENSORS * device];
    uint16_t *reading = &devices->reading[SENSORS * device];
    host_io *io = &devices->robot[device]->io;
    int side;

    for (side = 0; side < 2; side++) {
        if (!stuck[EYES + side]) {
            reading[EYES + side] = eye[side];
        }
        if (!stuck[FLOOR + side]) {
            reading[FLOOR + side] = floor[side];
        }
        if (!stuck[ARMS + side]) {
            reading[ARMS + side] = arm[side];
        }
        io->eye[side] = reading[EYES + side];
        io->floor[side] = reading[FLOOR + side];
        io->arm[side] = (uint8_t)reading[ARMS + side];
    }
}

/* Counters of way have 32 bits: after 2147 m they go on from the other end. */
static int32_t micrometres(double way)
{
    return (int32_t)(uint32_t)(int64_t)(way * 1e6);
}

void devices_measure(kernel_devices *devices, uint32_t device, double voltage, const double *travel, double ground)
{
    host_io *io = &devices->robot[device]->io;

    io->battery_mv = (uint16_t)(voltage * 1e3);
    io->travel_um[0] = micrometres(travel[0]);
    io->travel_um[1] = micrometres(travel[1]);
    io->ground_um = micrometres(ground);
}

uint8_t devices_tick(kernel_devices *devices, uint32_t device, int16_t *wheels)
{
    host_robot *robot = devices->robot[device];
    uint32_t sent = host_tick(robot, devices->micros[device], devices->rx[device], devices->rx_len[device]);
    int side;

    devices->rx_len[device] = 0;
    devices->micros[device] += devices->period_us;
    for (side = 0; side < 2; side++) { /* half to even, as Python's round */
        wheels[side] = (int16_t)nearbyint(robot->io.wheel[side] * devices->effort[2 * device + (uint32_t)side]);
    }
    if (sent > 0 && devices->fresh[device]) {
        devices->system[device] = robot->io.tx[devices->system_at] & devices->system_mask;
        devices->fresh[device] = 0;
    }
    if (!robot->io.reboot) {
        return 0;
    }
    host_restart(robot);
    robot->io.tx_len = sent;
    devices->micros[device] = 0;
    devices->fresh[device] = 1;
    return 1;
}
