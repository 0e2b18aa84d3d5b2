"""What a report tells of a swarm's mission."""
