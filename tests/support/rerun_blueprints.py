"""The blueprints for Rerun that come with the package; as a program, makes them: needs rerun-sdk, which nothing else does.

python tests/support/rerun_blueprints.py
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final, NamedTuple

from hil.cli.log_viewers import APPLICATION
from hil.look.viewers import layouts

FOLDER: Final = Path(layouts.__file__).with_name("layouts")
COLORS: Final = ((86, 180, 233), (230, 159, 0))
"""As colour-blind people tell them apart."""


class Curves(NamedTuple):
    """A plot of fields of one topic.

    Attributes:
        title: What is said above it.
        topic: The topic.
        schema: What its entries look like.
        fields: The fields, and what they are called.
    """

    title: str
    topic: str
    schema: str
    fields: tuple[tuple[str, str], ...]


CURVES: Final[dict[str, tuple[Curves, ...]]] = {
    layouts.JUNIOR: (
        Curves("Eyes, ADC counts", "/junior/sensors", "JuniorSensors", (("eye[0]", "left"), ("eye[1]", "right"))),
        Curves("Floor sensors, ADC counts", "/junior/sensors", "JuniorSensors", (("floor[0]", "left"), ("floor[1]", "right"))),
        Curves("Wheels, m travelled", "/junior/sensors", "JuniorSensors", (("travel[0]", "left"), ("travel[1]", "right"))),
        Curves("Battery, V", "/junior/sensors", "JuniorSensors", (("battery", "battery"),)),
    ),
    layouts.SWARM: (
        Curves(
            "Shares",
            "/surround/state",
            "SurroundStateRecord",
            (("share_surrounded", "WILDs surrounded"), ("outside", "RANGERs outside")),
        ),
        Curves(
            "Distances, in the book's units",
            "/surround/state",
            "SurroundStateRecord",
            (("distance", "RANGER to the nearest WILD"), ("ranger_distance", "RANGER to RANGER")),
        ),
    ),
}


def blueprint(kind: str) -> Any:  # noqa: ANN401 - Rerun's
    """A blueprint.

    Args:
        kind: Whose logs it is for.
    """
    import rerun.blueprint as rrb  # noqa: PLC0415 - only where they are made

    events = rrb.TextLogView(name="Events", origin="/log")
    seen = [_ring(), events] if kind == layouts.JUNIOR else [events]
    panels = [panel(state="collapsed") for panel in (rrb.BlueprintPanel, rrb.SelectionPanel)]
    return rrb.Blueprint(
        rrb.Horizontal(rrb.Vertical(*seen), rrb.Vertical(*map(_plot, CURVES[kind]))),
        rrb.TimePanel(timeline="message_log_time", state="collapsed"),
        *panels,
        auto_layout=False,
        auto_views=False,
    )


def _ring() -> Any:  # noqa: ANN401 - likewise
    import rerun.blueprint as rrb  # noqa: PLC0415 - likewise

    return rrb.Spatial3DView(
        name="The ring",
        origin="/",
        contents=["/arena/outline/**", "/tf"],
        spatial_information=rrb.SpatialInformation(target_frame="world"),
        eye_controls=rrb.EyeControls3D(position=(0, -0.35, 0.85), look_target=(0, 0, 0), eye_up=(0, 0, 1)),
    )


def _plot(curves: Curves) -> Any:  # noqa: ANN401 - likewise
    import rerun as rr  # noqa: PLC0415 - likewise
    import rerun.blueprint as rrb  # noqa: PLC0415
    from rerun.blueprint.encodings import ComponentSourceKind, VisualizerComponentMapping  # noqa: PLC0415

    lines = []
    for (field, name), color in zip(curves.fields, COLORS, strict=False):
        mapping = VisualizerComponentMapping(
            target="Scalars:scalars",
            source_kind=ComponentSourceKind.SourceComponent,
            source_component=f"hil.{curves.schema}:message",
            selector=f".{field}",
        )
        lines.append(rr.SeriesLines(names=name, colors=color).visualizer(mappings=[mapping]))
    return rrb.TimeSeriesView(name=curves.title, origin="/", contents=[curves.topic], overrides={curves.topic: lines})


def main() -> None:
    """Write them to where the package has them."""
    for kind in CURVES:
        blueprint(kind).save(APPLICATION, FOLDER / f"{kind}.rbl")


if __name__ == "__main__":
    main()
