"""The swarm: micro-robots on one network or more, held as one; rounds in which all are asked, or moved, at once."""
