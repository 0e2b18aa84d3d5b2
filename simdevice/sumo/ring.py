"""The sumo ring's measures."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SumoRing:
    """The sumo ring; its border is the rectangle about the origin.

    Attributes:
        width: Along x, in m.
        height: Along y, in m.
        rim: Distance from the border to the rim of the table, in m.
    """

    width: float = 0.65
    height: float = 0.42
    rim: float = 0.60

    def clearance(self, x: float, y: float) -> float:
        """Distance from a point to the border, in m; negative outside.

        Outside beyond a corner it is the larger of the two overshoots, not the distance to the corner.
        """
        return min(self.width / 2 - abs(x), self.height / 2 - abs(y))
