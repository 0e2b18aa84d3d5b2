"""An emulated robot in real time, behind ptys, ports and CAN buses."""
