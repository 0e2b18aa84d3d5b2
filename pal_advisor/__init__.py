"""What the PC learns: numpy, no I/O, no clock, no threads."""
