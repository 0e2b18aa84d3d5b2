"""Jobs of swarms."""
