"""What a scene says in words: headline, summary, the figures that matter most."""

from __future__ import annotations

from statistics import median
from typing import TYPE_CHECKING, Final

from hil.statistics import Rate

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from hil.look.scene import Chapter, Scene
    from hil.mcaplog.records import CoachedRunRecord

MOST_SERIES: Final = 6
MOST_NAMED: Final = 3
"""Opponents named in the headline."""
COACHING: Final = "coaching"
ABOUT: Final = {
    "run": {"command": "Command", "started": "Started"},
    "config": {"link": "Link", "seed": "Seed", "version": "junior-hil", "protocol": "Protocol"},
}


def tell(
    scene: Scene,
    metadata: Mapping[str, Mapping[str, str]],
    classes: Mapping[str, int],
    trials: int,
    coached: Sequence[CoachedRunRecord] = (),
) -> None:
    """Put words into a scene that holds all else.

    Args:
        scene: The scene.
        metadata: The log's metadata records.
        classes: How many robots of each class there are in a swarm.
        trials: Maneuvers performed for a learner.
        coached: Several coachings that the log tells of.
    """
    bouts = [chapter for chapter in scene.chapters if chapter.outcome]
    scene.title = _title(scene, bouts, classes, trials or len(coached))
    if coached:
        performed, begun = sum(run.maneuvers for run in coached), sum(run.bouts for run in coached)
        scene.said.append(
            f"Pal coached {len(coached):,} robots, apart, which performed {performed:,} maneuvers in {begun:,} bouts. "
            "One advice was made of what they learnt. How each learnt is in its own log in that folder: run-1.mcap ..."
        )
        scene.facts.append((f"{performed:,}", f"maneuvers performed by {len(coached):,} robots"))
    if trials:
        coaching = [bout for bout in bouts if bout.series in {COACHING, ""}]
        scene.said.append(f"Pal had Junior perform {trials:,} maneuvers in {len(coaching):,} bouts, and learnt from each.")
        scene.facts.append((f"{trials:,}", "maneuvers performed"))
    scene.said += _played(bouts)
    scene.facts += _won(bouts)
    scene.said += [chapter.story for chapter in scene.chapters if chapter.series == "surround" and chapter.story][:MOST_SERIES]
    if classes:
        scene.facts += [(f"{count:,}", f"{kind.upper()}s" if kind != "robot" else "robots") for kind, count in classes.items()]
    stops = sum(mark.kind == "safety" and "engaged" in mark.text for mark in scene.marks)
    if stops:
        scene.said.append(f"The e-stop was engaged {'once' if stops == 1 else f'{stops:,} times'}.")
        scene.facts.append((f"{stops:,}", "emergency stop" if stops == 1 else "emergency stops"))
    scene.facts.append((_duration(scene.end - scene.begin), "of log time"))
    if not scene.tracks and not scene.traces:
        scene.said.append("The log tells of no robot’s place and of no sensors: there are events only.")
    for record, names in ABOUT.items():
        scene.about += [(text, metadata[record][name]) for name, text in names.items() if metadata.get(record, {}).get(name)]


def _title(scene: Scene, bouts: list[Chapter], classes: Mapping[str, int], trials: int) -> str:
    against = list(dict.fromkeys(bout.against for bout in bouts if bout.against))
    named = " and ".join(against) if len(against) <= MOST_NAMED else f"{len(against)} opponents"
    versus = f" against {named}" if against else ""
    if trials:
        return f"Pal coached Junior{versus}"
    if bouts:
        return f"Junior’s bouts{versus}"
    if classes:
        missions = any(chapter.series == "surround" for chapter in scene.chapters)
        return "RANGERs surround WILDs" if missions else f"A swarm of {sum(classes.values()):,} micro-robots"
    return "What Junior sensed and did" if scene.tracks or scene.traces else "What happened"


def _played(bouts: list[Chapter]) -> list[str]:
    found = []
    series = list(dict.fromkeys((bout.series, bout.against) for bout in bouts))
    for title, against in series[:MOST_SERIES]:
        those = [bout for bout in bouts if (bout.series, bout.against) == (title, against) and bout.outcome != "broken off"]
        if not those:
            continue
        wins = [bout.end - bout.begin for bout in those if bout.outcome == "won"]
        rate = Rate(len(wins), len(those))
        low, high = rate.ci95
        name = title[:1].upper() + title[1:] if title else "Bouts"
        text = f"{name}, against {against}: {len(wins)} of {len(those)} won"
        text += f" ({rate.value:.0%}, 95 % interval {low:.0%} to {high:.0%})"
        found.append(text + (f", half of the wins within {median(wins):.1f} s." if wins else "."))
    if len(series) > MOST_SERIES:
        found.append(f"There are {len(series) - MOST_SERIES:,} more series of bouts.")
    return found


def _won(bouts: list[Chapter]) -> list[tuple[str, str]]:
    played = [bout for bout in bouts if bout.series not in {COACHING, ""}] or bouts
    those = [bout for bout in played if bout.series == played[0].series and bout.outcome != "broken off"]
    if not those:
        return []
    wins = sum(bout.outcome == "won" for bout in those)
    return [(f"{wins} of {len(those)}", f"won, {those[0].series}" if those[0].series else "bouts won")]


def _duration(seconds: float) -> str:
    return f"{seconds / 60:.1f} min" if seconds >= 120 else f"{seconds:.1f} s"
