"""Writes everything that follows from the messages: dialect, DBC, C tables and the protocol page."""

from firmware_protocol.generate.outputs import OUTPUTS, ROOT, stale

__all__ = ["OUTPUTS", "ROOT", "stale"]
