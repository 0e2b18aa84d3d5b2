"""A log as a source of steps: the recorded input goes through today's program, and what that decides is compared."""
