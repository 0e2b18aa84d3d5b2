"""Pictures of a sumo robot: curves of what it senses, and the ring as the referee sees it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.messages import JuniorSensors, RefereeState, RobotSession
from hil.mcaplog.writing.drawing import POINTS, SCENE, TRANSFORMS, encode_outline, encode_scene, encode_transforms
from hil.mcaplog.writing.joints import DEFINITION, JOINT_STATE, JointPlots
from hil.recording.protagonist import Protagonist
from hil.recording.scene import SceneClock, places, shapes

if TYPE_CHECKING:
    from firmware_protocol.events import Received
    from firmware_protocol.wire.batch import Batch
    from firmware_protocol.wire.fields import Message
    from hil.mcaplog.writing.sink import LogSink


class SumoDrawing:
    """Draws one of several robots: the `Protagonist`.

    Args:
        writer: Takes the entries.
    """

    kinds: frozenset[type[Message]] = frozenset({JuniorSensors, RefereeState})

    def __init__(self, writer: LogSink) -> None:
        self._writer = writer
        self._plots = JointPlots()
        self._scene = SceneClock()
        self._drawn = Protagonist()

    def received(self, event: Received) -> None:
        """See `Drawing.received`."""
        message = event.message
        if isinstance(message, JuniorSensors) and self._drawn.heard(event.system):
            self._plot(message, event.time)
        elif isinstance(message, RefereeState) and self._drawn.heard(event.system):
            self._draw(message, event.time)

    def heard_rows(self, batch: Batch) -> None:
        """See `Drawing.heard_rows`."""
        if batch.message in self.kinds:
            for _, event in batch.objects():
                self.received(event)

    def sent(self, message: Message) -> None:
        """See `Drawing.sent`."""
        if isinstance(message, RobotSession):
            self._drawn.taken(message.target_system)

    def _plot(self, sensors: JuniorSensors, time: float) -> None:
        for topic, data in self._plots.due(time, sensors):
            channel = self._writer.raw_channel(topic, JOINT_STATE, DEFINITION, schema_encoding="ros2msg", encoding="cdr")
            self._writer.write(channel, time, data)

    def _draw(self, state: RefereeState, time: float) -> None:
        pose, scene = self._scene.due(state, time)
        writer = self._writer
        if scene:
            pieces = shapes(state.opponent_code)
            writer.write(writer.raw_channel("/arena/scene", *SCENE), time, encode_scene(time, pieces))
            for piece in pieces:
                topic = f"/arena/outline/{piece.id}"
                writer.write(writer.raw_channel(topic, *POINTS), time, encode_outline(time, piece))
        if pose:
            writer.write(writer.raw_channel("/tf", *TRANSFORMS), time, encode_transforms(time, places(state)))
