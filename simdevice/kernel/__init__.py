"""A whole control period of emulated robots in C: `loop.h` knows `world.h` and `devices.h`, which do not know each other."""
