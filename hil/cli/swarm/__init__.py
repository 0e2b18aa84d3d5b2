"""`hil swarm`: missions of micro-robots."""
