"""Writes everything that follows from the messages: dialect, DBC, C tables and the protocol page."""

from firmware_protocol.generate.outputs import GOLDEN, OUTPUTS, ROOT, stale

__all__ = ["GOLDEN", "OUTPUTS", "ROOT", "stale"]
