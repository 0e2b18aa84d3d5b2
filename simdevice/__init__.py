"""Hardware that is not there: pymunk bodies, sensors, motors, and a board that runs the real firmware."""
