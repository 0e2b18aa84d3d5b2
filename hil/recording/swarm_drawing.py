"""Pictures of a swarm: every robot where it last said to be, coloured by its class."""

from __future__ import annotations

from math import cos, pi, sin
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import ParamValue, SwarmObservation
from firmware_protocol.vocabulary import MICRO_ROBOT_RADIUS as BODY
from firmware_protocol.vocabulary import RobotClass
from firmware_protocol.wire.rows import column
from hil.mcaplog.writing.drawing import SCENE, TRANSFORMS, Placed, Shape, encode_scene, encode_transforms
from hil.recording.scene import POSE_INTERVAL, SCENE_INTERVAL

if TYPE_CHECKING:
    from firmware_protocol.events import Received
    from firmware_protocol.wire.batch import Batch
    from firmware_protocol.wire.fields import Message
    from hil.mcaplog.writing.sink import LogSink

CORNERS: Final = 12
COLORS: Final = {RobotClass.RANGER: (0.0, 0.45, 0.70, 0.9), RobotClass.WILD: (0.84, 0.37, 0.0, 0.9)}
"""By class, as colour-blind people tell them apart."""
UNKNOWN: Final = (0.54, 0.54, 0.54, 0.9)
_DRAWN: Final[frozenset[type[Message]]] = frozenset({SwarmObservation, ParamValue})
_OUTLINE: Final = (
    (1.3 * BODY, 0.0),  # a nose, by which one sees where it looks
    *((BODY * cos(2 * pi * corner / CORNERS), BODY * sin(2 * pi * corner / CORNERS)) for corner in range(1, CORNERS)),
)


class SwarmDrawing:
    """Draws the micro-robots of one network.

    Args:
        writer: Takes the entries.

    Attributes:
        draws: Something is drawn.
    """

    def __init__(self, writer: LogSink) -> None:
        self.draws = True
        self._writer = writer
        self._classes: dict[int, RobotClass] = {}
        self._places: dict[int, Placed] = {}
        self._told: set[int] = set()
        self._drawn: set[int] = set()
        self._pose_at = -POSE_INTERVAL
        self._scene_at = -SCENE_INTERVAL

    @property
    def kinds(self) -> frozenset[type[Message]]:
        """See `Drawing.kinds`."""
        return _DRAWN if self.draws else frozenset()

    def received(self, event: Received) -> None:
        """See `Drawing.received`."""
        message, system = event.message, event.system
        if not self.draws:
            return
        if isinstance(message, SwarmObservation):
            x, y = message.position
            self._places[system] = Placed(f"robot {system}", x, y, message.heading)
            self._told.add(system)
            self._draw(event.time)
        elif isinstance(message, ParamValue) and message.param_id == "CLASS" and message.param_value in set(RobotClass):
            self._classes[system] = RobotClass(int(message.param_value))
            self._drawn.discard(system)

    def heard_rows(self, batch: Batch) -> None:
        """See `Drawing.heard_rows`."""
        if not self.draws:
            return
        if batch.message is SwarmObservation:
            systems = batch.system.tolist()
            x_y = column(SwarmObservation, batch.rows, "position").tolist()
            headings = column(SwarmObservation, batch.rows, "heading").tolist()
            for system, (x, y), heading in zip(systems, x_y, headings, strict=True):
                self._places[system] = Placed(f"robot {system}", x, y, heading)
            self._told.update(systems)
            self._draw(float(batch.time[-1]))
        elif batch.message is ParamValue:
            for _, event in batch.objects():
                self.received(event)

    def sent(self, message: Message) -> None:
        """See `Drawing.sent`."""

    def _draw(self, time: float) -> None:
        """Draw what is due."""
        writer = self._writer
        new = not self._drawn.issuperset(self._places)
        if new or time - self._scene_at >= SCENE_INTERVAL:
            self._scene_at = time
            self._drawn = set(self._places)
            shapes = [self._shape(system) for system in sorted(self._places)]
            writer.write(writer.raw_channel("/arena/scene", *SCENE), time, encode_scene(time, shapes))
        if new or time - self._pose_at >= POSE_INTERVAL - 1e-6:
            self._pose_at = time
            places = [self._places[system] for system in sorted(self._told)]
            self._told.clear()
            writer.write(writer.raw_channel("/tf", *TRANSFORMS), time, encode_transforms(time, places))

    def _shape(self, system: int) -> Shape:
        kind = self._classes.get(system)
        name = "robot" if kind is None else kind.name
        return Shape(f"{name} {system}", f"robot {system}", _OUTLINE, UNKNOWN if kind is None else COLORS[kind], 0.002)
