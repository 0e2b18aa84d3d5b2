"""Codecs without I/O: bytes or frames to messages and back; signatures; layouts made from the annotations."""
