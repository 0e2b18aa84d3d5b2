"""What viewers draw without being told how: poses, outlines and text lines in Foxglove's well-known protobuf schemas.

foxglove-sdk's typed messages serve as encoder; nothing of its logging or its server is used here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from struct import Struct
from typing import TYPE_CHECKING, Final, NamedTuple

from foxglove.messages import (
    Color,
    FrameTransform,
    FrameTransforms,
    LinePrimitive,
    LinePrimitiveLineType,
    Log,
    LogLevel,
    PackedElementField,
    PackedElementFieldNumericType,
    Point3,
    PointCloud,
    Pose,
    Quaternion,
    SceneEntity,
    SceneUpdate,
    Timestamp,
    TriangleListPrimitive,
    Vector3,
)

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


def _well_known(kind: type[FrameTransforms | SceneUpdate | PointCloud | Log]) -> WellKnown:
    schema = kind.get_schema()
    return WellKnown(schema.name, bytes(schema.data))


TRANSFORMS: Final = _well_known(FrameTransforms)
SCENE: Final = _well_known(SceneUpdate)
POINTS: Final = _well_known(PointCloud)
TEXT: Final = _well_known(Log)


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


def stamp(time: float) -> Timestamp:
    """A log time as viewers want it.

    Args:
        time: In s, not negative.
    """
    return Timestamp(*divmod(round(time * 1e9), 1_000_000_000))


def encode_transforms(time: float, places: Sequence[Placed]) -> bytes:
    """Poses in the world, for `/tf`.

    Args:
        time: Log time in s.
        places: Where each frame is.
    """
    when = stamp(time)
    transforms = [
        FrameTransform(
            timestamp=when,
            parent_frame_id=WORLD,
            child_frame_id=place.frame,
            translation=Vector3(x=place.x, y=place.y, z=0.0),
            rotation=Quaternion(x=0.0, y=0.0, z=_short(math.sin(place.heading / 2)), w=_short(math.cos(place.heading / 2))),
        )
        for place in places
    ]
    return FrameTransforms(transforms=transforms).encode()


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
    return SceneUpdate(entities=[_entity(stamp(time), shape) for shape in shapes]).encode()


def _entity(when: Timestamp, shape: Shape) -> SceneEntity:
    corners = [Point3(x=x, y=y, z=shape.height) for x, y in shape.points]
    fan = [corner for i in range(1, len(corners) - 1) for corner in (corners[0], corners[i], corners[i + 1])]
    red, green, blue, opacity = shape.color
    pose = Pose(position=Vector3(), orientation=Quaternion(w=1.0))
    edge = LinePrimitive(
        type=LinePrimitiveLineType.LineLoop,
        pose=pose,
        thickness=2.0,
        scale_invariant=True,
        points=corners,
        color=Color(r=red * 0.6, g=green * 0.6, b=blue * 0.6, a=1.0),
    )
    face = TriangleListPrimitive(pose=pose, points=fan, color=Color(r=red, g=green, b=blue, a=opacity))
    return SceneEntity(timestamp=when, frame_id=shape.frame, id=shape.id, frame_locked=True, lines=[edge], triangles=[face])


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
    number = PackedElementFieldNumericType.Float32
    return PointCloud(
        timestamp=stamp(time),
        frame_id=shape.frame,
        pose=Pose(position=Vector3(), orientation=Quaternion(w=1.0)),
        point_stride=_XYZ.size,
        fields=[PackedElementField(name=name, offset=4 * i, type=number) for i, name in enumerate("xyz")],
        data=bytes(data),
    ).encode()


_LEVELS: Final = (
    LogLevel.Fatal, LogLevel.Fatal, LogLevel.Fatal, LogLevel.Error,
    LogLevel.Warning, LogLevel.Info, LogLevel.Info, LogLevel.Debug,
)  # fmt: skip


def encode_text(time: float, severity: int, text: str, source: str) -> bytes:
    """A line for a person, for `/log`.

    Args:
        time: Log time in s.
        severity: MAV_SEVERITY: 0 emergency .. 6 information, 7 debug.
        text: The line.
        source: Who says it.
    """
    level = _LEVELS[min(max(severity, 0), 7)]
    return Log(timestamp=stamp(time), level=level, message=text, name=source).encode()
