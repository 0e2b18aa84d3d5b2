"""What the ring looks like: outlines, and where they are. All of it follows from REFEREE_STATE and from nothing else."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import OpponentCode
from hil.mcaplog.writing.drawing import WORLD, Placed, Shape
from simdevice.junior.profile import JUNIOR_OUTLINE
from simdevice.sumo.opponents import OPPONENTS
from simdevice.sumo.ring import SumoRing

if TYPE_CHECKING:
    from firmware_protocol.messages import RefereeState

JUNIOR: Final = "junior"
OPPONENT: Final = "opponent"
POSE_INTERVAL: Final = 0.1
"""Log time between poses, in s."""
SCENE_INTERVAL: Final = 10.0
"""Log time between repetitions of the whole scene, in s: a viewer that enters in the middle sees it after so long."""

JUNIOR_COLOR: Final = (0.0, 0.45, 0.70, 0.9)
OPPONENT_COLOR: Final = (0.84, 0.37, 0.0, 0.9)
RING_COLOR: Final = (0.93, 0.93, 0.90, 0.6)


def ring_size() -> tuple[float, float]:
    """Width (along x) and height (along y) of the ring, in m."""
    ring = SumoRing()
    return ring.width, ring.height


def junior_outline() -> tuple[tuple[float, float], ...]:
    """Corners of Junior's outline in its own frame, in m: x forward, y left."""
    return JUNIOR_OUTLINE.vertices


def opponent_outline(code: int) -> tuple[tuple[float, float], ...]:
    """Corners of an opponent's outline in its own frame, in m; empty where nobody knows it.

    Args:
        code: As in REFEREE_STATE (`OpponentCode`).
    """
    if code == OpponentCode.JUNIOR:
        return JUNIOR_OUTLINE.vertices
    if code not in set(OpponentCode):
        return ()
    spec = OPPONENTS.get(OpponentCode(code).label)
    return spec.outline.vertices if spec else ()


def shapes(opponent: int) -> tuple[Shape, ...]:
    """Everything there is to see in the ring.

    Args:
        opponent: As in REFEREE_STATE.
    """
    width, height = (side / 2 for side in ring_size())
    ring = ((width, height), (-width, height), (-width, -height), (width, -height))
    found = [
        Shape("ring", WORLD, ring, RING_COLOR),
        Shape(JUNIOR, JUNIOR, junior_outline(), JUNIOR_COLOR, 0.002),
    ]
    other = opponent_outline(opponent)
    if other:
        found.append(Shape(OPPONENT, OPPONENT, other, OPPONENT_COLOR, 0.002))
    return tuple(found)


def places(state: RefereeState) -> tuple[Placed, Placed]:
    """Where Junior and the opponent are.

    Args:
        state: What the referee sees.
    """
    return (
        Placed(JUNIOR, state.junior[0], state.junior[1], state.junior_heading),
        Placed(OPPONENT, state.opponent[0], state.opponent[1], state.opponent_heading),
    )


class SceneClock:
    """Decides when the scene is due again, by log time."""

    def __init__(self) -> None:
        self._pose_at = -POSE_INTERVAL
        self._scene_at = -SCENE_INTERVAL
        self._bout = -1
        self._opponent = -1

    def due(self, state: RefereeState, time: float) -> tuple[bool, bool]:
        """Whether poses, and the whole scene, are due.

        Args:
            state: What the referee sees.
            time: Log time in s.

        Returns:
            (poses are due, the scene is due).
        """
        new_bout = state.bout != self._bout
        scene = state.opponent_code != self._opponent or time - self._scene_at >= SCENE_INTERVAL
        pose = scene or new_bout or time - self._pose_at >= POSE_INTERVAL - 1e-6
        if pose:
            self._pose_at = time
        if scene:
            self._scene_at = time
        self._bout, self._opponent = state.bout, state.opponent_code
        return pose, scene
