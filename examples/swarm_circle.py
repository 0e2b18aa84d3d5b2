"""A swarm in ten lines: every robot drives to its place on a circle, and looks to the middle.

Run it on 33 emulated micro-robots, which need nothing:

    python examples/swarm_circle.py

or on robots of yours, on one link or several; they drive, so clear a square of two metres:

    python examples/swarm_circle.py udpin://0.0.0.0:14550
"""

from __future__ import annotations

import sys

import numpy as np

import hil

RADIUS = 0.7
"""Of the circle, in m."""
OPTIONS = hil.MoveOption.STOP_ON_CONTACT
TRIES = 6
"""Who meets another on its way stops there, and sets out again."""


def main(*urls: str) -> None:
    """Drive everybody to a circle.

    Args:
        *urls: Addresses of the robots' links.
    """
    # Leaving the block stops and disarms all robots, whatever happens inside.
    with hil.connect_swarm(*urls) as swarm:
        swarm.arm()
        for _ in range(TRIES):
            seen = swarm.observe()
            angle = np.linspace(-np.pi, np.pi, len(swarm.there), endpoint=False)[np.argsort(np.argsort(bearing(seen)))]
            goal = RADIUS * np.stack([np.cos(angle), np.sin(angle)], axis=1)
            x, y = (goal - seen.position).T
            inwards = np.mod(angle + 2 * np.pi, 2 * np.pi) - np.pi
            moving = seen.there & (np.hypot(x, y) > 0.01)
            way = np.where(moving, np.hypot(x, y), 0.0)
            done = swarm.move(
                hil.SwarmMoves(moving, way, np.where(moving, np.arctan2(y, x), 0.0), face=inwards, options=OPTIONS)
            )
            print(f"{moving.sum()} moved within {done.seconds:.1f} s, {len(done.missing)} are missing")
        off = np.linalg.norm(swarm.observe().position, axis=1) - RADIUS
        print(f"{np.sum(np.abs(off) < 0.02)} of {len(off)} robots stand on the circle")


def bearing(seen: hil.Round) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """In which direction of the middle each robot is, in rad; who has said nothing comes last."""
    return np.nan_to_num(np.arctan2(seen.position[:, 1], seen.position[:, 0]), nan=np.pi)


if __name__ == "__main__":
    main(*(sys.argv[1:] or ["sim://swarm"]))
