"""Your own tactics in the ring: a hand-written reflex controller plays bouts, and its wins are counted.

The controller here arcs towards the side that sees, pushes when both eyes see, and where pushing has led nowhere for 0.6 s
it backs off and rams. Change it and run it again; the same seeds give the same bouts:

    python examples/own_controller.py
    python examples/own_controller.py point-light --trials 40

`hil bout --help` names the opponents.
"""

from __future__ import annotations

import argparse

import hil
from hil import Action, Maneuver, Stimulus
from hil.sumo.bouts import Tally, play
from hil.sumo.controllers import ChaseController, Controller
from hil.sumo.ring import open_ring

EYES = Stimulus.EYE_LEFT | Stimulus.EYE_RIGHT
ARMS = Stimulus.ARM_LEFT | Stimulus.ARM_RIGHT

PUSH = Maneuver((Action.FF,) * 8, period=0.075, end_on_change=True)
"""0.6 s ahead; the robot breaks it off by itself as soon as it sees something else."""
RAM = Maneuver((Action.FB,) * 2 + (Action.FF,) * 4, period=0.15)
"""Back off for 0.3 s, then charge."""


def turn(action: Action) -> Maneuver:
    """Turn until the eyes see something else, at most for 2 s."""
    return Maneuver((action,) * 8, period=0.25, end_on_change=True)


class RamController:
    """Chases by arcs, and rams what it cannot push."""

    def choose(self, current: Stimulus, previous: Stimulus | None) -> Maneuver:
        """The next maneuver.

        Args:
            current: What the robot senses.
            previous: What it sensed when its last maneuver began; None at the beginning of a bout.
        """
        touching = bool(current & ARMS)
        if touching and previous is not None and previous & ARMS:
            return RAM
        match current & EYES:
            case Stimulus.NONE if not touching:
                return turn(Action.LBRF)  # spin on the spot
            case Stimulus.EYE_LEFT if not touching:
                return turn(Action.LSRF)  # arc to the left: left wheel stalled, right wheel forward
            case Stimulus.EYE_RIGHT if not touching:
                return turn(Action.LFRS)
            case _:
                return PUSH


def bouts(controller: Controller, opponent: str, trials: int) -> Tally:
    """Play bouts in the emulated ring.

    Args:
        controller: Chooses the maneuvers.
        opponent: Who stands in the ring.
        trials: How many bouts; their start poses come from the seeds 1, 2, 3, ...

    Returns:
        The score.
    """
    with hil.connect(f"sim://junior?opponent={opponent}&seed=1") as junior:
        junior.arm()
        return Tally.of(opponent, list(play(open_ring(junior), controller, range(1, trials + 1))))


def main() -> None:
    """Play with this controller, and with the simplest one beside it."""
    parser = argparse.ArgumentParser(description="Play bouts with a hand-written controller.")
    parser.add_argument("opponent", nargs="?", default="flat-heavy")
    parser.add_argument("--trials", type=int, default=20)
    options = parser.parse_args()
    players: tuple[tuple[str, Controller], ...] = (("ram", RamController()), ("chase", ChaseController()))
    for name, controller in players:
        tally = bouts(controller, options.opponent, options.trials)
        low, high = tally.win_rate.ci95
        time = f"{tally.median_time_to_win:.1f} s" if tally.median_time_to_win is not None else "-"
        print(
            f"{name:5} against {tally.opponent}: won {tally.wins} of {tally.trials} "
            f"(95 % interval {low:.2f} to {high:.2f}), lost {tally.losses}, median time to win {time}"
        )


if __name__ == "__main__":
    main()
