"""The bridge: connects, coaches, records, replays, shows."""
