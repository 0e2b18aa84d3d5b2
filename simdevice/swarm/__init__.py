"""The table of micro-robots: bodies, noise, obstacles."""
