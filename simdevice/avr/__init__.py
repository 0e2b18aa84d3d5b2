"""The board as an ATmega328P: the firmware's own ELF in simavr."""
