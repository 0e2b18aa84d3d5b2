"""A camera over the table that is not there: where robots are, as a camera's program would tell it, some hidden at times.

An emulated table is what it looks at. In three terminals:

    hil emulate swarm --no-ring --link tcp://127.0.0.1:5760 --poses-to udpout://127.0.0.1:14601
    python examples/fake_camera.py udpin://127.0.0.1:14601 udpout://127.0.0.1:14600 --hidden 0.05
    hil swarm surround tcp://127.0.0.1:5760 --case B2D3 --poses udpin://127.0.0.1:14600

A real one sends the same lines, `NETWORK ID x y heading age_ms` in m, rad and ms, one for each robot that it sees.
"""

from __future__ import annotations

import argparse
import contextlib
from typing import TYPE_CHECKING

import numpy as np

from firmware_protocol import open_link
from firmware_protocol.errors import LinkError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

BLUR = 0.001
"""Standard deviation of a position, in m."""


def seen(lines: Sequence[str], draw: np.random.Generator, hidden: float) -> Iterator[str]:
    """What the camera makes of where robots are.

    Args:
        lines: A line for each robot.
        draw: Draws who is hidden, and how blurred the others are.
        hidden: Share of the looks at a robot in which something is in the way.
    """
    for line in lines:
        network, system, x, y, heading, age = line.split()
        if draw.random() >= hidden:
            x, y = (f"{float(at) + draw.normal(0.0, BLUR):.4f}" for at in (x, y))
            yield f"{network} {system} {x} {y} {heading} {age}"


def main() -> None:
    """Look, and tell, until Ctrl-C."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source", help="where lines come from, as udpin://127.0.0.1:14601")
    parser.add_argument("target", help="where they go to, as udpout://127.0.0.1:14600")
    parser.add_argument("--hidden", type=float, default=0.0, help="share of looks at a robot that fail")
    parser.add_argument("--seed", type=int, default=1, help="seed of who is hidden")
    asked = parser.parse_args()
    draw = np.random.default_rng(asked.seed)
    with open_link(asked.source) as source, open_link(asked.target) as target, contextlib.suppress(KeyboardInterrupt):
        while True:
            lines = source.read(0.5).decode(errors="replace").splitlines()
            told = [line for line in lines if len(line.split()) == 6]
            if told:
                with contextlib.suppress(LinkError):  # nobody listens yet
                    target.write("".join(f"{line}\n" for line in seen(told, draw, asked.hidden)).encode())


if __name__ == "__main__":
    main()
