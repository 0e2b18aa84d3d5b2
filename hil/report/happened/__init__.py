"""What happened in a run: states of the robots, emergency stops, keys, and what else is worth telling."""
