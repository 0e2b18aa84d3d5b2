"""Junior's hardware that is not there: body, sensors, motors, what goes wrong with them, and a second one as an opponent."""
