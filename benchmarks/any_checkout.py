"""Plays lock-step bouts with whatever checkout is first on the path, of now or of before, and prints how fast it was.

`lockstep_bout.py CHECKOUT` runs it. Modules are taken from the folder that they are in there.

    PYTHONPATH=CHECKOUT python benchmarks/any_checkout.py OPPONENT BOUTS
"""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from time import process_time
from typing import TYPE_CHECKING, Any

import hil
from firmware_protocol.vocabulary import Action, Maneuver, Stimulus

if TYPE_CHECKING:
    from collections.abc import Callable

REACTIONS = {
    0: (Action.LBRF, Action.LBRF, Action.MF, Action.S),
    1: (Action.LBRF, Action.MF, Action.MF, Action.FF),
    2: (Action.LFRB, Action.MF, Action.MF, Action.FF),
    3: (Action.FF, Action.FF, Action.FF, Action.FF),
}


class FourActions:
    """Plays as a coached robot does: maneuvers of four actions of 200 ms each."""

    def choose(self, current: Stimulus, previous: Stimulus | None) -> Maneuver:  # noqa: ARG002
        """The same maneuver for the same eyes."""
        return Maneuver(REACTIONS[current & 3], period=0.2)


def of(module: str, name: str) -> Callable[..., Any]:
    """A function of a module of `hil`, in the folder that it is in now or in none, as before."""
    folder = "hil.sumo" if (Path(hil.__file__).parent / "sumo").is_dir() else "hil"
    function: Callable[..., Any] = getattr(importlib.import_module(f"{folder}.{module}"), name)
    return function


def main() -> None:
    """Play, and print simulated seconds per second of this process."""
    opponent, count = sys.argv[1], int(sys.argv[2])
    open_ring, play = of("ring", "open_ring"), of("bouts", "play")
    with hil.connect(f"sim://junior?opponent={opponent}&seed=1") as junior:
        junior.arm()
        ring = open_ring(junior)
        for _ in play(ring, FourActions(), [0]):  # loads what is loaded when it is wanted
            pass
        since, start = junior.now(), process_time()
        for _ in play(ring, FourActions(), range(1, count + 1)):
            pass
        print((junior.now() - since) / (process_time() - start))


if __name__ == "__main__":
    main()
