"""Builds the host version of the firmware, `firmware_protocol.firmware._host`, as a cffi extension in API mode.

setup.py hands `builder` to setuptools; paths are relative to the folder of setup.py. `CC` chooses the compiler.
"""

from __future__ import annotations

from pathlib import Path

import cffi

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = Path("firmware_protocol/firmware")
FOLDERS = ("core", "targets/host")

DECLARATIONS = """
typedef struct {
    uint16_t eye[2];
    uint16_t floor[2];
    uint16_t battery_mv;
    uint8_t  arm[2];
    uint8_t  has_encoders;
    uint8_t  has_ground;
    int32_t  travel_um[2];
    int32_t  ground_um;
    uint8_t  start;
    int16_t  wheel[2];
    uint8_t  reboot;
    uint8_t  tx[2048];
    uint32_t tx_len;
    uint8_t  nvm[1024];
    uint64_t uid;
    uint8_t  can;
} host_io;
typedef struct { host_io io; ...; } host_robot;
void host_power_on(host_robot *r, uint64_t micros);
void host_give_key(host_robot *r, const uint8_t *key);
uint32_t host_tick(host_robot *r, uint64_t micros, const uint8_t *rx, uint32_t rx_len);
void host_power_on_cut(host_robot *r, uint64_t micros, int32_t writes);
void host_cut_power(host_robot *r, int32_t writes);
void host_slow_down(host_robot *r, uint32_t nvm_per_tick, uint32_t tx_buffer, uint32_t tx_per_tick);
void host_be_busy(host_robot *r, uint16_t micros);
uint32_t host_can_send(host_robot *r, uint16_t id, const uint8_t *payload, uint8_t length);
int32_t host_can_take(host_robot *r, const uint8_t *rx, uint32_t rx_len, uint8_t *payload);
uint8_t host_state(const host_robot *r);
uint32_t host_nvm_writes(const host_robot *r);
"""

builder = cffi.FFI()
builder.cdef(DECLARATIONS)
builder.set_source(
    "firmware_protocol.firmware._host",
    '#include "host.h"',
    sources=[
        *sorted((FIRMWARE / "core" / path.name).as_posix() for path in (ROOT / FIRMWARE / "core").glob("*.c")),
        (FIRMWARE / "targets/host/host.c").as_posix(),
    ],
    depends=[
        "firmware_protocol/dialect/junior.xml",
        *sorted(path.relative_to(ROOT).as_posix() for folder in FOLDERS for path in (ROOT / FIRMWARE / folder).glob("*.h")),
    ],
    define_macros=[("JUNIOR_CAN", "1"), ("JUNIOR_SIGNING", "1")],
    include_dirs=[(FIRMWARE / folder).as_posix() for folder in (*FOLDERS, "_build")],
)
