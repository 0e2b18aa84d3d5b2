"""Where bytes travel: serial ports, TCP, UDP, in-process memory, and faults on any of them."""

from firmware_protocol.faults.spec import FaultSpec
from firmware_protocol.links.faulty import FaultCounts, FaultyLink
from firmware_protocol.links.memory import MemoryLink, Steppable
from firmware_protocol.links.reopen import LinkOpener
from firmware_protocol.links.serial import SerialLink, SerialPort, list_ports
from firmware_protocol.links.tcp import TcpLink
from firmware_protocol.links.udp import UdpLink

__all__ = [
    "FaultCounts",
    "FaultSpec",
    "FaultyLink",
    "LinkOpener",
    "MemoryLink",
    "SerialLink",
    "SerialPort",
    "Steppable",
    "TcpLink",
    "UdpLink",
    "list_ports",
]
