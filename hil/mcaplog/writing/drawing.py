"""What viewers draw without being told how: poses, outlines and text lines in Foxglove's well-known protobuf schemas.

The schemas are those that foxglove-sdk embeds, as files beside this; protobuf makes the messages from them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib.resources import files
from struct import Struct
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass

if TYPE_CHECKING:
    from collections.abc import Sequence

WORLD: Final = "world"
"""The one root of all frames: x right, y up, origin at the centre of the ring."""

Point = tuple[float, float]


class WellKnown(NamedTuple):
    """A schema that viewers know.

    Attributes:
        name: Full protobuf name.
        data: Serialized FileDescriptorSet.
    """

    name: str
    data: bytes


def _well_known(name: str) -> WellKnown:
    return WellKnown(name, files("hil.mcaplog").joinpath("well_known", f"{name}.binpb").read_bytes())


TRANSFORMS: Final = _well_known("foxglove.FrameTransforms")
SCENE: Final = _well_known("foxglove.SceneUpdate")
POINTS: Final = _well_known("foxglove.PointCloud")
TEXT: Final = _well_known("foxglove.Log")


def message_class(schema: WellKnown) -> Any:  # noqa: ANN401 - protobuf makes it
    """The class of a schema's messages.

    Args:
        schema: The schema.
    """
    pool = DescriptorPool()
    for file in FileDescriptorSet.FromString(schema.data).file:
        pool.Add(file)
    return GetMessageClass(pool.FindMessageTypeByName(schema.name))


_Transforms: Final = message_class(TRANSFORMS)
_Scene: Final = message_class(SCENE)
_Points: Final = message_class(POINTS)
_Text: Final = message_class(TEXT)


class Placed(NamedTuple):
    """Where a frame is in the world.

    Attributes:
        frame: Its name.
        x: In m.
        y: In m.
        heading: In rad, counter-clockwise.
    """

    frame: str
    x: float
    y: float
    heading: float


@dataclass(frozen=True)
class Shape:
    """A flat convex shape.

    Attributes:
        id: Name, unique in a scene.
        frame: Frame it is given in, and moves with.
        points: Corners in order, in m; shape (n, 2).
        color: Red, green, blue, opacity, each 0 to 1.
        height: Above the table, in m.
    """

    id: str
    frame: str
    points: tuple[Point, ...]
    color: tuple[float, float, float, float]
    height: float = 0.0


def stamp(message: Any, time: float) -> None:  # noqa: ANN401 - protobuf's
    """Give a message a log time as viewers want it.

    Args:
        message: One with a `timestamp`.
        time: In s, not negative.
    """
    when = message.timestamp
    when.SetInParent()
    when.seconds, when.nanos = divmod(round(time * 1e9), 1_000_000_000)


def encode_transforms(time: float, places: Sequence[Placed]) -> bytes:
    """Poses in the world, for `/tf`.

    Args:
        time: Log time in s.
        places: Where each frame is.
    """
    message = _Transforms()
    add = message.transforms.add
    for place in places:
        transform = add(parent_frame_id=WORLD, child_frame_id=place.frame)
        stamp(transform, time)
        translation, rotation = transform.translation, transform.rotation
        translation.x, translation.y = place.x + 0.0, place.y + 0.0  # minus zero is zero
        translation.SetInParent()
        half = place.heading / 2
        rotation.z, rotation.w = _short(math.sin(half)), _short(math.cos(half))
    return bytes(message.SerializeToString())


def _short(number: float) -> float:
    """To a millionth, in few binary digits: the rest would be a third of what poses take in a log."""
    return round(number * _MILLION) / _MILLION


_MILLION: Final = float(1 << 20)


def encode_scene(time: float, shapes: Sequence[Shape]) -> bytes:
    """Shapes that move with their frames.

    Args:
        time: Log time in s.
        shapes: What there is to see.
    """
    message = _Scene()
    for shape in shapes:
        _add_entity(message, time, shape)
    return bytes(message.SerializeToString())


def _add_entity(message: Any, time: float, shape: Shape) -> None:  # noqa: ANN401 - protobuf's
    corners = [{"x": x + 0.0, "y": y + 0.0, "z": shape.height + 0.0} for x, y in shape.points]
    fan = [corner for i in range(1, len(corners) - 1) for corner in (corners[0], corners[i], corners[i + 1])]
    red, green, blue, opacity = shape.color
    entity = message.entities.add(frame_id=shape.frame, id=shape.id, frame_locked=True)
    stamp(entity, time)
    entity.lines.add(
        type=_LINE_LOOP,
        pose=_UPRIGHT,
        thickness=2.0,
        scale_invariant=True,
        points=corners,
        color={"r": red * 0.6, "g": green * 0.6, "b": blue * 0.6, "a": 1.0},
    )
    entity.triangles.add(pose=_UPRIGHT, points=fan, color={"r": red, "g": green, "b": blue, "a": opacity})


_LINE_LOOP: Final = 1
_UPRIGHT: Final = {"position": {}, "orientation": {"w": 1.0}}
"""A pose at the origin of its frame."""
_XYZ: Final = Struct("<3f")


def encode_outline(time: float, shape: Shape, spacing: float = 0.005) -> bytes:
    """The border of a shape as points, for viewers that know no scenes.

    Args:
        time: Log time in s.
        shape: The shape.
        spacing: Distance between points, in m.
    """
    data = bytearray()
    for (ax, ay), (bx, by) in zip(shape.points, (*shape.points[1:], shape.points[0]), strict=True):
        steps = max(1, math.ceil(math.hypot(bx - ax, by - ay) / spacing))
        for i in range(steps):
            share = i / steps
            data += _XYZ.pack(ax + (bx - ax) * share, ay + (by - ay) * share, shape.height)
    message = _Points(frame_id=shape.frame, pose=_UPRIGHT, point_stride=_XYZ.size, data=bytes(data))
    stamp(message, time)
    for i, name in enumerate("xyz"):
        message.fields.add(name=name, offset=4 * i, type=_FLOAT32)
    return bytes(message.SerializeToString())


_FLOAT32: Final = 7
_LEVELS: Final = (5, 5, 5, 4, 3, 2, 2, 1)
"""foxglove.Log's levels, fatal 5 to debug 1, by MAV_SEVERITY."""


def encode_text(time: float, severity: int, text: str, source: str) -> bytes:
    """A line for a person, for `/log`.

    Args:
        time: Log time in s.
        severity: MAV_SEVERITY: 0 emergency .. 6 information, 7 debug.
        text: The line.
        source: Who says it.
    """
    message = _Text(level=_LEVELS[min(max(severity, 0), 7)], message=text, name=source)
    stamp(message, time)
    return bytes(message.SerializeToString())
