"""Pictures of the link and of what the robot sensed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.messages import SensorFlag
from hil.report.style import AMBER, BLUE, GREEN, GREY, INK, PURPLE, VERMILLION, bare, figure, whole_numbers
from hil.statistics import quantile

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from hil.report.run_data import RunData, SensorTrack

BINS: Final = 120
MOST_EVENTS: Final = 200
"""Events marked."""
MOST_POINTS: Final = 1200
"""Points a line is thinned to: two for each point of the picture's width, the least and the greatest value there."""
_FLAGS: Final = (
    ("left eye sees", SensorFlag.EYE_LEFT, BLUE),
    ("right eye sees", SensorFlag.EYE_RIGHT, VERMILLION),
    ("left arm pressed", SensorFlag.ARM_LEFT, BLUE),
    ("right arm pressed", SensorFlag.ARM_RIGHT, VERMILLION),
    ("left off the ring", SensorFlag.OFF_RING_LEFT, BLUE),
    ("right off the ring", SensorFlag.OFF_RING_RIGHT, VERMILLION),
)


def link_quality(data: RunData) -> Figure | None:
    """Frames over time, good, lost and rejected, and how long answers took.

    Args:
        data: The run.

    Returns:
        The picture; None where nothing was received.
    """
    link = data.link
    if len(link.arrivals) < 2:
        return None
    drawn = figure(9.0, 2.9)
    left, right = drawn.subplots(1, 2, width_ratios=[3, 2])
    start, end = link.arrivals[0], max(link.arrivals[-1], link.arrivals[0] + 1e-3)
    edges = np.linspace(start, end, max(2, min(BINS, int(end - start) + 1)) + 1)
    width = edges[1] - edges[0]
    scale, unit = (60.0, "min") if end - start > 180 else (1.0, "s")
    for times, color, name, line in (
        (link.arrivals, BLUE, "received", "-"),
        (link.gaps, VERMILLION, "lost", "--"),
        (link.refusals, PURPLE, "rejected", ":"),
    ):
        counts, _ = np.histogram(times, edges)
        left.step(edges[:-1] / scale, counts / width, where="post", color=color, linestyle=line, linewidth=1.4,
                  label=f"{name}: {len(times):,}")  # fmt: skip
    left.set_ylim(0, None)
    left.set_xlim(edges[0] / scale, edges[-2] / scale)
    left.set_title("Frames from\nthe robot")
    left.set_xlabel(f"Log time ({unit})")
    left.set_ylabel("Frames per second")
    _legend_beside_title(left, 3)
    _round_trips(right, np.array(link.round_trips) * 1e3)
    return drawn


def _legend_beside_title(axes: Axes, columns: int) -> None:
    axes.legend(
        loc="lower right", bbox_to_anchor=(1.0, 0.985), ncols=columns, borderaxespad=0.2, handlelength=1.6, columnspacing=1.2
    )


def _round_trips(axes: Axes, times: NDArray[np.float64]) -> None:
    axes.set_title("From question\nto answer")
    if not len(times):
        bare(axes)
        axes.text(0.5, 0.5, "no question was answered", transform=axes.transAxes, ha="center", color=GREY)
        return
    axes.set_xlabel("Time (ms)")
    axes.set_ylabel("Answers")
    shown = quantile(times, 0.995) * 1.1 or 1.0
    axes.hist(np.minimum(times, shown), bins=40, range=(0.0, shown), color=BLUE, alpha=0.85)
    for value, name, line in ((quantile(times, 0.5), "median", "-"), (quantile(times, 0.99), "99 %", "--")):
        axes.axvline(value, color=INK, linestyle=line, linewidth=1.1, label=f"{name}: {value:.3g} ms")
    axes.set_xlim(0, shown)
    whole_numbers(axes.yaxis)
    _legend_beside_title(axes, 1)


def sensors_over_time(data: RunData) -> Figure | None:
    """What the robot sensed and what its wheels were told, over time.

    Args:
        data: The run.

    Returns:
        The picture; None where it sent no sensor message.
    """
    track = data.sensors
    if track is None or len(track.times) < 2:
        return None
    drawn = figure(9.0, 7.6)
    eyes, floor, wheels, flags, battery = drawn.subplots(5, 1, sharex=True, height_ratios=[2, 2, 2, 1.8, 1.4])
    gaps = track.gaps
    for axes, values, title in ((eyes, track.eye, "Eyes"), (floor, track.floor, "Floor sensors")):
        for side, (name, color, line) in enumerate((("left", BLUE, "-"), ("right", VERMILLION, "--"))):
            axes.plot(
                *_broken(*with_extremes(track.times, values[:, side]), gaps),
                color=color,
                linestyle=line,
                linewidth=1.0,
                label=name,
            )
        axes.set_title(title)
        axes.set_ylabel("ADC counts")
        axes.set_ylim(0, 1023)
        _legend_beside_title(axes, 2)
    _wheels(wheels, track)
    for row, (_, flag, color) in enumerate(reversed(_FLAGS)):
        _spans(flags, track, int(flag), row, color)
        flags.axhline(row, color="#E4E4E4", linewidth=0.6, zorder=0)
    flags.set_yticks(range(len(_FLAGS)), [name for name, _, _ in reversed(_FLAGS)])
    flags.set_ylim(-0.6, len(_FLAGS) - 0.4)
    flags.tick_params(axis="y", length=0)
    flags.grid(visible=False, axis="y")
    flags.set_title("What it makes of them")
    battery.plot(*_broken(*with_extremes(track.times, track.battery), gaps), color=GREEN, linewidth=1.2)
    for start, end in gaps:
        for axes in (eyes, floor, flags, battery):
            axes.axvspan(start, end, color="#EFEFEF", linewidth=0, zorder=0)
    battery.set_title("Battery")
    battery.set_ylabel("V")
    battery.set_xlabel("Log time (s)")
    battery.set_xlim(track.times[0], track.times[-1])
    battery.margins(y=0.3)
    for when in [when for when, event in data.events if event.kind in {"link", "safety"}][:MOST_EVENTS]:
        for axes in (eyes, floor, wheels, flags, battery):
            axes.axvline(when, color=AMBER, linewidth=1.0, zorder=0)
    return drawn


def with_extremes(
    times: NDArray[np.float64], values: NDArray[np.float64], most: int = MOST_POINTS
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A line with fewer points, in which every extreme is left.

    Args:
        times: Its times in s; shape (n,).
        values: Its values; shape (n,).
        most: About as many points are left.

    Returns:
        The times and the values that are left, in order.
    """
    if len(times) <= most:
        return times, values
    parts = np.array_split(np.arange(len(times)), most // 2)
    kept = np.unique([index for part in parts for index in (part[values[part].argmin()], part[values[part].argmax()])])
    return times[kept], values[kept]


def _broken(
    times: NDArray[np.float64], values: NDArray[np.float64], gaps: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A line that is not drawn across the times in which no reading came."""
    at = np.searchsorted(times, gaps[:, 0], side="right")
    return np.insert(times, at, gaps[:, 0]), np.insert(values, at, np.nan)


def _wheels(axes: Axes, track: SensorTrack) -> None:
    axes.set_title("Wheel commands")
    axes.set_ylabel("Share of full")
    axes.set_ylim(-1.05, 1.05)
    if not len(track.wheel_times):
        axes.text(
            0.5, 0.5, "the wheels were not commanded one by one", transform=axes.transAxes, ha="center", va="center", color=GREY
        )
        return
    until = np.append(track.wheel_times[1:], np.inf)
    ends = np.minimum(track.wheel_times + track.wheels[:, 2], until)
    for side, (name, color, line) in enumerate((("left", BLUE, "-"), ("right", VERMILLION, "--"))):
        times, speeds = _held(track.wheel_times, ends, track.wheels[:, side])
        axes.plot(times, speeds, color=color, linestyle=line, linewidth=1.1, label=name)
    _legend_beside_title(axes, 2)


def _held(
    starts: NDArray[np.float64], ends: NDArray[np.float64], speeds: NDArray[np.float64]
) -> tuple[Sequence[float], Sequence[float]]:
    """A line that holds each speed from its start to its end and is 0 in between."""
    times: list[float] = []
    values: list[float] = []
    for start, end, speed in zip(starts.tolist(), ends.tolist(), speeds.tolist(), strict=True):
        if times and start > times[-1]:
            times += [times[-1], start]
            values += [0.0, 0.0]
        times += [start, end]
        values += [speed, speed]
    return [*times, times[-1]], [*values, 0.0]


def _spans(axes: Axes, track: SensorTrack, flag: int, row: int, color: str) -> None:
    """Bars where a flag is set, as far as that is known: not across the times in which no reading came."""
    spans: list[tuple[float, float]] = []
    cuts = np.searchsorted(track.times, track.gaps[:, 1])
    for times, flags in zip(np.split(track.times, cuts), np.split(track.flags, cuts), strict=True):
        steps = np.diff(np.concatenate(([0], (flags & flag != 0).astype(int), [0])))
        ends_at = np.append(times, times[-1])
        spans += [
            (float(times[start]), float(max(ends_at[end] - times[start], 1e-3)))
            for start, end in zip(np.flatnonzero(steps == 1), np.flatnonzero(steps == -1), strict=True)
        ]
    axes.broken_barh(spans, (row - 0.32, 0.64), facecolors=color, linewidth=0)
