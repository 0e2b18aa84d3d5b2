"""Scenes made up for tests of pages: with a text in every field that takes one, and logs full of hostile texts."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from report_logs import FRAME, Wire

from firmware_protocol.messages import BoutOutcome, JuniorSensors, OpponentCode, ParamValue, Phase, RefereeState
from hil.bridge.operator import OperatorInput
from hil.bridge.taps import Circumstances
from hil.look.scene import (
    Beam,
    BodyShape,
    Chapter,
    Ground,
    Lane,
    LearningCurves,
    LearntManeuver,
    LearntStep,
    Mark,
    Scene,
    Spot,
    Terrain,
    TimeCurves,
    Track,
)
from hil.mcaplog.records import (
    AdviceRecord,
    EventRecord,
    StepRecord,
    SurroundGenerationRecord,
    SurroundStateRecord,
    TrialRecord,
)
from hil.recording.recorder import Recorder

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

HOSTILE: Final = (
    "</script><script>alert(1)</script>",
    "<!--<script>alert(2)//",
    "]]><img src=x onerror=alert(3)>",
    '"><svg onload=alert(4)><a href="javascript:alert(5)">',
    "\u2028alert(6)\u2029&lt;b&gt;&#60;i&#62;",
    "{{script}}{{scene}}{{policy}}",
    "'; alert(7); //\\\" \x00\x1b[2J \ud800",
    "<style>@import 'https://example.invalid/x.css'</style><link rel=stylesheet href=https://example.invalid/y.css>",
    "__proto__",
    "constructor",
)


def unpacked(data: bytes, place: dict[str, Any]) -> NDArray[np.float64]:
    """A column, as the page's script reads it.

    Args:
        data: All columns of a document, inflated.
        place: Where it is, and how it is read.
    """
    at, count, width = place["at"], place["n"], place["b"]
    planes = np.frombuffer(data[at : at + count * width], np.uint8).reshape(width, count)
    whole = np.cumsum(np.ascontiguousarray(planes.T).view(f"<i{width}").ravel().astype(np.int64))
    found = whole * place["s"]
    return np.where(whole == place["z"], np.nan, found) if "z" in place else found


def scene_of(text: str, other: str = "x") -> Scene:
    """A scene of everything there can be, with a text in every field.

    Args:
        text: The text.
        other: The same of the second one where there are two whose names must differ.
    """
    times = np.arange(10.0)
    wave = np.sin(times)
    shape = BodyShape(
        ((0.05, 0.0), (-0.05, 0.05), (-0.05, -0.05)), 0.05, (Beam(0, 0, 0, 0.3, 0.4, 1),), (Spot(text, ((0.0, 0.0),), 1),)
    )
    poses = {"t": times, "x": 0.1 * wave, "y": 0.1 * wave, "heading": wave}
    seen = {"t": times, "flags": np.ones(10), "near0": np.ones(10), "near1": np.zeros(10), "radius": np.full(10, 0.2)}
    rays = {"t": times, "hits": np.ones(10), "r0": np.full(10, 0.2), "r1": np.full(10, np.nan)}
    return Scene(
        text,
        text,
        [text, other],
        [(text, text)],
        [text],
        [(text, text)],
        0.0,
        9.0,
        Terrain(Ground.TABLE, 1.0, 1.0),
        [
            Track(text, text, "ranger", shape, {**seen, **poses}, {}, rays),
            Track(other, text, text, shape, poses, {"t": times, "flags": np.ones(10)}),
        ],
        [TimeCurves(text, text, (text, text), times, (wave, -wave), level=0.0, level_name=text)],
        [Lane(text, times[:2], times[1:3], np.array([0.0, 1.0]), (text, text), (text, ""), ("even", text))],
        [Mark(1.0, text, text), Mark(2.0, "link", text)],
        [Chapter(text, text, 0.0, 5.0, text, text, text), Chapter(text, other, 5.0, 9.0, "lost", text, text)],
        [LearningCurves(text, text, text, (text, text), (times, times), (wave, wave))],
        [LearntManeuver(text, (LearntStep(text, text, 1.0, -1.0),), text, text, (text,)), LearntManeuver(text, (), text, text)],
    )


def hostile_log(path: Path, text: str) -> None:
    """A log that has a hostile text wherever a log can have one.

    Args:
        path: Where it goes.
        text: The text.
    """
    names = dict.fromkeys(("command", "started", "link", "seed", "version", "protocol", "objective"), text)
    with Recorder(path, run=names, config=names, link=text, lockstep=False) as recorder:
        recorder.metadata("robot", {"uid": text, text: text})
        wire = Wire(recorder)
        recorder.series(text)
        recorder.step(0.1, [(0.1, FRAME)], Circumstances((OperatorInput(f"key {text}", text), OperatorInput(text))))
        for number in range(4):
            wire.now = 0.2 + 0.1 * number
            wire.up(ParamValue(text[:16], 1.0, 9, 1, 0))
            wire.up(JuniorSensors(wire.now, (0.0, 0.0), (1, 2), (3, 4), 7.4, number))
            over = number == 3
            outcome = BoutOutcome.LOSS if over else BoutOutcome.UNDECIDED
            phase = Phase.OVER if over else Phase.RUNNING
            state = RefereeState(
                wire.now, 1, 0.1 * number, (0.0, 0.1), 0.0, (0.1, 0.0), 0.0, 0.1, phase, outcome, OpponentCode.JUNIOR
            )
            wire.up(state, component=25)
        recorder.note(text, text, **{text: text})
        recorder.record("/events", EventRecord(text, text, text), 0.6)
        recorder.record("/pal/generation", StepRecord(text, text, 1, 0, 5, 5, 1.0, 0.5, text), 0.6)
        recorder.record("/pal/generation", StepRecord("any", text, 1, 1, 9, 9, 2.0, 0.5, text), 0.7)
        for number in (1, 2):
            trial = TrialRecord(number, text, text, 1, False, text, 0.2, 1.0, 4, False, False, None, 0.8, text)  # noqa: FBT003
            recorder.record("/pal/trial", trial, 0.6 + 0.1 * number)
        entries = [{"previous": "any", "current": text, "actions": [text], "fitness": 1.0, "evaluations": 1}]
        recorder.record("/pal/advice", AdviceRecord(json.dumps({"objective": text, "opponent": text, "entries": entries})), 0.8)
        for step in (0, 1):
            state_record = SurroundStateRecord(
                seed=1, step=step, steps=1, distance=1.0, ranger_distance=2.0, share_surrounded=0.5, outside=0.0,
                ranger_stimuli=(), ranger_behaviours=(), wild_stimuli=(), wild_behaviours=(), case=text, area=(2.0, 2.0),
                body=0.02, ranger_positions=(), wild_positions=(), tables=text, digest=text, measures=text,
            )  # fmt: skip
            recorder.record("/surround/state", state_record, 0.8 + 0.1 * step)
            recorder.record(
                "/surround/generation", SurroundGenerationRecord(1, step, 1.0, 0.5, text, (text,)), 0.9 + 0.1 * step
            )
