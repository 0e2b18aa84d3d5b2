"""The one time step of the emulation."""

from typing import Final

PERIOD: Final = 0.005
"""Control period, firmware tick and step of the physics, in s."""
PERIOD_US: Final = 5000
"""The same in microseconds."""
