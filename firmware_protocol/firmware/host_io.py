"""The struct `host_io` of targets/host/host.h. Made by `python -m firmware_protocol.generate`."""

from typing import Final

FIELDS: Final = (
    ("eye", "2H"),
    ("floor", "2H"),
    ("battery_mv", "H"),
    ("arm", "2B"),
    ("has_encoders", "B"),
    ("has_ground", "B"),
    ("travel_um", "2i"),
    ("ground_um", "i"),
    ("start", "B"),
    ("wheel", "2h"),
    ("reboot", "B"),
    ("tx", "2048B"),
    ("tx_len", "I"),
    ("nvm", "1024B"),
    ("uid", "Q"),
    ("can", "B"),
    ("role", "B"),
)
"""Name of each field, in order, and its type as module `struct` writes it."""
