"""What viewers draw is encoded as foxglove-sdk encodes it, byte for byte, and by its schemas."""

from __future__ import annotations

import math
from struct import pack

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
from hypothesis import given
from hypothesis import strategies as st
from well_known_schemas import FOLDER, schemas

from hil.mcaplog.writing.drawing import Placed, Shape, encode_outline, encode_scene, encode_text, encode_transforms

NUMBERS = st.one_of(st.sampled_from([0.0, -0.0, 1.0]), st.floats(-1e6, 1e6))
TIMES = st.one_of(st.just(0.0), st.integers(0, 10**15).map(lambda nanoseconds: nanoseconds / 1e9))
SHARES = st.floats(0, 1)
NAMES = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)


def when(time: float) -> Timestamp:
    return Timestamp(*divmod(round(time * 1e9), 1_000_000_000))


def test_the_schemas_are_those_of_the_sdk() -> None:
    assert {path.name: path.read_bytes() for path in FOLDER.iterdir()} == schemas()


@given(TIMES, st.lists(st.builds(Placed, NAMES, NUMBERS, NUMBERS, st.floats(-10, 10)), max_size=3))
def test_transforms(time: float, places: list[Placed]) -> None:
    def short(number: float) -> float:
        return round(number * 2**20) / 2**20

    expected = FrameTransforms(
        transforms=[
            FrameTransform(
                timestamp=when(time),
                parent_frame_id="world",
                child_frame_id=place.frame,
                translation=Vector3(x=place.x, y=place.y, z=0.0),
                rotation=Quaternion(x=0.0, y=0.0, z=short(math.sin(place.heading / 2)), w=short(math.cos(place.heading / 2))),
            )
            for place in places
        ]
    )
    assert encode_transforms(time, places) == expected.encode()


@given(
    TIMES,
    st.builds(
        Shape,
        NAMES,
        NAMES,
        st.lists(st.tuples(NUMBERS, NUMBERS), max_size=5).map(tuple),
        st.tuples(SHARES, SHARES, SHARES, SHARES),
        NUMBERS,
    ),
)
def test_scenes(time: float, shape: Shape) -> None:
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
    entity = SceneEntity(
        timestamp=when(time), frame_id=shape.frame, id=shape.id, frame_locked=True, lines=[edge], triangles=[face]
    )
    assert encode_scene(time, [shape, shape]) == SceneUpdate(entities=[entity, entity]).encode()


def test_outlines() -> None:
    shape = Shape("junior", "junior", ((0.0, 0.0), (0.004, 0.0)), (1.0, 0.0, 0.0, 1.0), 0.5)
    expected = PointCloud(
        timestamp=when(2.5),
        frame_id="junior",
        pose=Pose(position=Vector3(), orientation=Quaternion(w=1.0)),
        point_stride=12,
        fields=[
            PackedElementField(name=name, offset=4 * i, type=PackedElementFieldNumericType.Float32)
            for i, name in enumerate("xyz")
        ],
        data=pack("<6f", 0.0, 0.0, 0.5, 0.004, 0.0, 0.5),
    )
    assert encode_outline(2.5, shape) == expected.encode()


@given(TIMES, st.integers(-2, 10), NAMES, NAMES)
def test_texts(time: float, severity: int, text: str, source: str) -> None:
    levels = [LogLevel.Fatal] * 3 + [LogLevel.Error, LogLevel.Warning, LogLevel.Info, LogLevel.Info, LogLevel.Debug]
    level = levels[min(max(severity, 0), 7)]
    assert (
        encode_text(time, severity, text, source) == Log(timestamp=when(time), level=level, message=text, name=source).encode()
    )
