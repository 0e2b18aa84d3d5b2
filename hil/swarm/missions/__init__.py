"""Missions of a swarm: each joins an adviser to the swarm host, and measures what comes of it."""
