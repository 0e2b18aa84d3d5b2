"""A whole control period of emulated robots in C: `loop.h` knows `world.h` and `devices.h`, which do not know each other.

`table.h` is the world of micro-robots; it knows none of them.
"""
