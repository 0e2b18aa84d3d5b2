"""The well-known schemas as foxglove-sdk has them; as a program, writes them to where ours are.

python tests/support/well_known_schemas.py
"""

from __future__ import annotations

from pathlib import Path

from foxglove.messages import FrameTransforms, Log, PointCloud, SceneUpdate

FOLDER = Path(__file__).resolve().parents[2] / "hil" / "mcaplog" / "well_known"


def schemas() -> dict[str, bytes]:
    """A serialized FileDescriptorSet by name of the file."""
    found = [kind.get_schema() for kind in (FrameTransforms, Log, PointCloud, SceneUpdate)]
    return {f"{schema.name}.binpb": bytes(schema.data) for schema in found}


if __name__ == "__main__":
    for name, data in schemas().items():
        (FOLDER / name).write_bytes(data)
