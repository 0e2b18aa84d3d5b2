"""What a coaching run came to, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.vocabulary import ANY_STIMULUS, Stimulus, codes
from hil.sumo.challenging import challenge_in_words
from hil.sumo.controllers import BUILT_IN
from hil.sumo.ring import OPPONENTS
from pal_advisor.maneuvers import Contender

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.sumo.bouts import Tally
    from hil.sumo.coaching import Coaching
    from hil.sumo.team import CoachedRun
    from pal_advisor.maneuvers import Advice, AdviceEntry, Challenge, TeamVerdict

EYES = {0: "no eye sees it", 1: "the left eye sees it", 2: "the right eye sees it", 3: "both eyes see it"}
PLAYS = "How it plays"
ARMS = {0: "", 4: ", the left arm touches", 8: ", the right arm touches", 12: ", both arms touch"}


def in_words(stimulus: int) -> str:
    """A stimulus in words.

    Args:
        stimulus: Its code.
    """
    return EYES[stimulus & 3] + ARMS[stimulus & 12]


def situation_in_words(entry: AdviceEntry) -> str:
    """The situation that an entry is for: `both eyes see it`, and what was seen before, where that matters."""
    before = "" if entry.previous == ANY_STIMULUS else f" (before: {in_words(entry.previous)})"
    return f"{in_words(entry.current)}{before}"


def label(entry: AdviceEntry) -> str:
    """Short name of the situation an entry is for; see `situation_label`."""
    return situation_label(entry.previous, entry.current)


def situation_label(previous: int, current: int) -> str:
    """Short name of a situation: `both`, or `left>both` where the previous stimulus matters.

    Args:
        previous: Previous stimulus as a wire code, or `ANY_STIMULUS`.
        current: Current stimulus as a wire code.
    """
    name = Stimulus(current).label
    return name if previous == ANY_STIMULUS else f"{Stimulus(previous).label}>{name}"


def per_stimulus(advice: Advice) -> dict[str, dict[str, object]]:
    """What was learnt, by the name of the situation.

    Args:
        advice: What was learnt.

    Returns:
        Plain values.
    """
    return {
        label(entry): {
            "maneuver": [action.name for action in entry.actions],
            **({} if entry.period is None else {"period": entry.period}),
            "fitness": round(entry.fitness, 3),
            "evaluations": entry.evaluations,
            "names": list(entry.names),
        }
        for entry in advice.entries
    }


def coaching_summary(
    coaching: Coaching,
    tally: Tally | None,
    random: Tally | None,
    *,
    opponent: str,
    files: dict[str, object],
    wall_seconds: float,
    by_rival: Sequence[Tally] = (),
) -> list[str]:
    """What was learnt, against what, how it plays, where the files are.

    Args:
        coaching: The run.
        tally: Held-out bouts played by the advice; None where there were none.
        random: The same with random maneuvers.
        opponent: Name of the opponent.
        files: Paths by name: advice, log, report, checkpoint.
        wall_seconds: Time it took, in s.
        by_rival: The held-out bouts by whom it met, where it met several robots.

    Returns:
        Lines.
    """
    progress, standing = coaching.progress, coaching.standing
    headline = (
        f"Pal coached Junior against {opponent}: {coaching.pal.used} maneuvers in {progress.bouts} bouts, "
        f"{progress.robot_seconds / 60:.1f} robot minutes, in {wall_seconds:.0f} s."
    )
    challenge = None if standing is None else standing.challenge
    lines = ["", headline, *_learnt(coaching.best(), tally, random, opponent=opponent, files=files, challenge=challenge)]
    if by_rival:
        won = ", ".join(f"{one.wins} of {one.trials} against {one.opponent}" for one in by_rival)
        place = next(place for place, line in enumerate(lines) if line.startswith(PLAYS))
        lines.insert(place + 1, f"  Won of these: {won}.")
    return lines


def team_summary(
    advice: Advice,
    runs: Sequence[CoachedRun],
    verdicts: Sequence[TeamVerdict],
    tally: Tally | None,
    random: Tally | None,
    *,
    opponent: str,
    robot_seconds: float,
    files: dict[str, object],
    wall_seconds: float,
    challenge: Challenge | None = None,
) -> list[str]:
    """What several runs have learnt together, as `coaching_summary`.

    Args:
        advice: What was put together.
        runs: What came of each run.
        verdicts: What the team exam found out.
        tally: Held-out bouts played by the advice; None where there were none.
        random: The same with random maneuvers.
        opponent: Name of the opponent.
        robot_seconds: Time that robots performed, in s.
        files: Paths by name.
        wall_seconds: Time it took, in s.
        challenge: Whether it has taken the place of the advice that was given; None where there was none.

    Returns:
        Lines.
    """
    maneuvers, bouts = sum(run.maneuvers for run in runs), sum(run.bouts for run in runs)
    headline = (
        f"Pal coached {len(runs)} Juniors against {opponent}, apart: {maneuvers} maneuvers in {bouts} bouts, "
        f"{robot_seconds / 60:.1f} robot minutes with the team exam, in {wall_seconds:.0f} s."
    )
    lines = ["", headline]
    for verdict in verdicts:
        if verdict.kept:
            score = verdict.score
            what = (
                f"Run {verdict.run} did best"
                if verdict.category is None
                else f"Better with what run {verdict.run} does when {in_words(verdict.category[1])}"
            )
            lines.append(f"  {what}: {score.wins} of {score.trials} bouts won in the team exam.")
    return [*lines, *_learnt(advice, tally, random, opponent=opponent, files=files, challenge=challenge)]


def shortfall(tally: Tally | None, require: float | None) -> str:
    """What is said where fewer of the held-out bouts were won than required; empty where none fewer were.

    Args:
        tally: These bouts; None where there were none.
        require: Share of them to be won; None for any.
    """
    if require is None or (tally is not None and tally.win_rate.value >= require):
        return ""
    none = ": there were none" if tally is None else ""
    return f"Fewer than the required {require:g} of the held-out bouts were won{none}."


def _learnt(
    advice: Advice,
    tally: Tally | None,
    random: Tally | None,
    *,
    opponent: str,
    files: dict[str, object],
    challenge: Challenge | None = None,
) -> list[str]:
    lines = [] if challenge is None else [challenge_in_words(challenge)]
    stays = challenge is not None and challenge.winner is not Contender.CHALLENGER
    lines += ["", "What the advice says that stays:" if stays else "What Junior learnt:"]
    for entry in advice.entries:
        called = f", {' and '.join(entry.names)}" if entry.names else ""
        times = "once" if entry.evaluations == 1 else f"{entry.evaluations} times"
        worth = f"Worth {entry.fitness:.1f}, tried {times}."
        lines.append(f"  When {situation_in_words(entry)}: {codes(entry.actions)}{called}. {worth}")
        lines.append(f"      {entry.in_words}")
    lines.append("")
    if tally is None:
        lines.append(f"{PLAYS} was not tried: there were no held-out bouts.")
    else:
        low, high = tally.win_rate.ci95
        won = f"{PLAYS}: won {tally.wins} of {tally.trials} bouts from fresh poses (95 % interval {low:.2f} to {high:.2f})"
        time = "" if tally.median_time_to_win is None else f", in {tally.median_time_to_win:.1f} s by the median"
        versus = f"; random maneuvers won {random.wins} of {random.trials}" if random else ""
        lines.append(f"{won}{time}{versus}.")
    lines.append("")
    kinds = ("advice", "report", "log", "checkpoint")
    lines += [f"{kind.capitalize() + ':':12}{files[kind]}" for kind in kinds if files.get(kind)]
    if files.get("learnt"):
        lines.append(f"{'Learnt:':12}{files['learnt']}")
    if files.get("log"):
        lines.append(f"{'Look at it:':12}hil view {files['log']}")
    if files.get("best_log"):
        lines.append(f"{'The best run:':12} hil view {files['best_log']}")
    if tally is not None and files.get("advice"):
        bout = f"hil bout --advice {files['advice']} --opponent {opponent}"
        play = bout if opponent in OPPONENTS else f"hil tournament {files['advice']} {' '.join(BUILT_IN)}"
        lines.append(f"{'Play it:':12}{play}")
    return lines
