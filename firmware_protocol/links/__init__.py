"""Where bytes travel: serial ports, TCP, UDP, in-process memory, and faults on any of them."""
