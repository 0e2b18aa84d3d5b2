"""What happened, in words and tables: plain values taken from the log, nothing computed twice."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import BoutOutcome, OpponentCode
from firmware_protocol.vocabulary import codes
from hil.mcaplog.making.slimming import SLIM
from hil.report.bout_figures import OUTCOME_WORDS
from hil.report.happened.words import interruptions_said, results_said, stops_said
from hil.report.learning_figures import Category, category_name, situation, sort_key
from hil.report.learnt import Learnt
from hil.report.report_table import ReportTable, counted, shortened
from hil.report.swarm.runs import surround_runs
from hil.report.swarm.search_words import search_said, search_title
from hil.report.swarm.words import surround_said
from hil.report.team.words import team_said
from hil.statistics import Rate, quantile

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.mcaplog.records import StepRecord, TrialRecord
    from hil.report.run_data import BoutPath, RunData

OBJECTIVES: Final = {
    "contact": "seeing, holding and coming into contact (Liu & Wu 2001, Eq. 10.1)",
    "effective": "seeing, coming into contact, and holding while gaining ground",
    "outcome": "gaining ground, bringing the opponent nearer to the border, and winning",
}
OUTCOME_COLUMNS: Final = (BoutOutcome.WIN, BoutOutcome.LOSS, BoutOutcome.DRAW, BoutOutcome.UNDECIDED)
MOST_NAMED: Final = 10
"""Series and opponents told of in words."""
SITUATION: Final = "The eyes that see it"
"""Head of the column that names situations, as it heads the legends of pictures."""
COACHING: Final = "coaching"
"""Title of the series of bouts in which something is learnt."""
HELD_OUT: Final = "bouts played by the advice"
"""Title of the series of bouts that an advice is judged by."""


def title_of(data: RunData) -> str:
    """The report's headline."""
    opponents = " and ".join(_opponents(data))
    versus = f" against {opponents}" if opponents else ""
    if data.evaluations:
        return search_title(data)
    if data.surround:
        return "RANGERs learnt to surround WILDs"
    if data.learnt:
        return f"Pal coached Junior{versus}"
    if data.bouts:
        return f"Junior’s bouts{versus}"
    return _title_of_others(data)


def _title_of_others(data: RunData) -> str:
    """The headline of a run in which nothing was learnt or played."""
    robots = len(data.course.states)
    if data.metadata.get("config", {}).get("verb") == "check":
        return "A robot was checked"
    if data.sensors is None and robots:
        return "What the robot did" if robots == 1 else f"What {robots:,} robots did"
    return "What Junior sensed and did"


def coaching_bouts(data: RunData) -> list[BoutPath]:
    """Bouts in which something was learnt."""
    if not data.learnt:
        return []
    return [bout for bout in data.bouts if bout.series in {COACHING, ""}]


def played_bouts(data: RunData) -> list[BoutPath]:
    """Bouts in which nothing was learnt."""
    learnt = {bout.number for bout in coaching_bouts(data)}
    return [bout for bout in data.bouts if bout.number not in learnt]


def main_series(played: Sequence[BoutPath]) -> str:
    """Title of the series that tells most of what was learnt: held-out bouts, else the first.

    Args:
        played: Bouts in which nothing was learnt, at least one.
    """
    return HELD_OUT if any(bout.series == HELD_OUT for bout in played) else played[0].series


def summary(data: RunData) -> list[str]:
    """What happened, a paragraph an item.

    Args:
        data: The run.
    """
    said = stops_said(data) + interruptions_said(data) + results_said(data)
    if data.learnt:
        said += [team_said(data)] if data.coached else [_effort(data), _progress(data)]
    series_played = _series(played_bouts(data))
    for (series, opponent), bouts in list(series_played.items())[:MOST_NAMED]:
        said.append(_played(series, opponent, bouts))
    if len(series_played) > MOST_NAMED:
        said.append(f"There were {len(series_played) - MOST_NAMED:,} more series of bouts: see the table.")
    if data.surround:
        said += surround_said(surround_runs(data))
    elif data.evaluations:
        said += search_said(data)
    elif data.of_junior:
        said.append(_watched(data))
    if not data.evaluations:
        said.append(_link_words(data))
    if not data.whole:
        said.append(f"The log is {data.health}. Everything here is of the part that could be read.")
    return [text for text in said if text]


def _effort(data: RunData) -> str:
    advice = data.advice or Learnt()
    budget = advice.budget
    objective = advice.objective or data.metadata.get("config", {}).get("objective", "")[:60]
    bouts = coaching_bouts(data)
    performed = sum(trial.duration for trial in data.trials)
    of = f" of a budget of {budget:,}" if budget is not None and budget != len(data.trials) else ""
    text = f"Junior performed {len(data.trials):,} maneuvers{of}"
    text += f" in {len(bouts):,} bouts" if bouts else ""
    text += f", {performed / 60:.1f} minutes of robot time." if performed >= 60 else f", {performed:.0f} s of robot time."
    if objective:
        text += f" The objective was “{objective}”: {OBJECTIVES.get(objective, 'not known to this program')}."
    return text


def _progress(data: RunData) -> str:
    over = [bout for bout in coaching_bouts(data) if bout.outcome is not BoutOutcome.UNDECIDED]
    if len(over) < 10:
        return ""
    part = max(5, len(over) // 5)
    first, last = (
        Rate(sum(bout.outcome is BoutOutcome.WIN for bout in some), len(some)) for some in (over[:part], over[-part:])
    )
    return (
        f"While it was learning it won {first.value:.0%} of its first {part} bouts and {last.value:.0%} of its last {part}. "
        "Those were played with maneuvers on trial, the last ones with the best being tested."
    )


def _played(series: str, opponent: str, bouts: Sequence[BoutPath]) -> str:
    over = [bout for bout in bouts if bout.outcome is not BoutOutcome.UNDECIDED]
    wins = [bout.duration for bout in over if bout.outcome is BoutOutcome.WIN]
    low, high = Rate(len(wins), len(over)).ci95
    name = shortened(series[:1].upper() + series[1:], 100) if series else "Bouts"
    text = f"{name}, against {opponent}: {len(wins)} of {len(over)} won"
    if over:
        text += f", {len(wins) / len(over):.1%} (95% interval {low:.1%} to {high:.1%})"
    return text + (f", half of the wins within {quantile(wins, 0.5):.1f} s." if wins else ".")


def _watched(data: RunData) -> str:
    text = f"The log covers {_time(data.duration)}."
    if data.sensors is not None:
        text += f" Junior sent {len(data.sensors.times):,} readings of its sensors"
        text += f", its battery was at {data.sensors.battery[-1]:.2f} V in the end." if data.sensors.battery[-1] > 0 else "."
        gaps = data.sensors.gaps
        if len(gaps):
            lengths = gaps[:, 1] - gaps[:, 0]
            text += f" For {_time(float(lengths.sum()))} none came, which is grey in the picture."
    return text


def _link_words(data: RunData) -> str:
    link = data.link
    if not link.good:
        if data.surround or data.evaluations:
            return "Workers played the runs, each with robots of its own: this log holds what came of them, and no messages."
        if SLIM in data.metadata:
            return "This log was made small: of what came from the robot it has the bytes, and no messages."
        return "Nothing was received from a robot."
    text = f"The link carried {link.good:,} good frames from the robot; "
    if not link.lost and not link.rejected and not link.retries:
        return text + "none was lost or damaged, and nothing had to be repeated."
    rejected = sum(link.rejected.values())
    troubles = [
        f"{link.lost:,} were lost or damaged ({link.loss:.2%})" if link.lost else "none was lost",
        f"{counted(rejected, 'piece of input was', 'pieces of input were')} rejected" if rejected else "",
        f"{counted(link.retries, 'command was', 'commands were')} sent again"
        if link.retries
        else "no command had to be repeated",
    ]
    *first, last = (trouble for trouble in troubles if trouble)
    return f"{text}{', '.join(first)}, and {last}."


def learnt_table(data: RunData) -> ReportTable | None:
    """The advice, a row for each situation."""
    entries = data.advice.entries if data.advice else ()
    if not entries:
        return None
    rows = tuple(
        (
            category_name(situation(entry)),
            entry.in_words,
            codes(entry.actions),
            ", ".join(entry.names) or "—",
            f"{entry.fitness:.2f}",
            str(entry.evaluations),
            str(entry.phase),
        )
        for entry in sorted(entries, key=lambda entry: sort_key(situation(entry)))
    )
    head = (SITUATION, "What Junior does", "In the book’s terms", "Known as", "Fitness", "Tried", "Phase")
    return ReportTable("What Junior learnt", head, rows, frozenset({4, 5, 6}))


def effort_table(data: RunData) -> ReportTable | None:
    """How much each category was practised."""
    if not data.trials:
        return None
    practised: dict[Category, list[TrialRecord]] = {}
    for trial in data.trials:
        practised.setdefault((trial.previous, trial.current), []).append(trial)
    made: dict[Category, list[StepRecord]] = {}
    for step in data.generations:
        made.setdefault((step.previous, step.current), []).append(step)
    rows = []
    for category in sorted(practised, key=sort_key):
        trials, steps = practised[category], made.get(category, [])
        first = [step for step in steps if step.phase == steps[0].phase]
        rows.append(
            (
                category_name(category),
                f"{len(trials):,}",
                f"{sum(trial.exam for trial in trials):,}",
                str(len(steps)),
                f"{first[0].best:.1f}" if first else "—",
                f"{steps[-1].best:.1f}" if steps else "—",
            )
        )
    head = (SITUATION, "Maneuvers", "of these in the exam", "Generations", "Best in the first", "Best in the last")
    return ReportTable("How much was practised", head, tuple(rows), frozenset(range(1, 6)))


def bout_table(data: RunData) -> ReportTable | None:
    """Outcomes by series and opponent."""
    if not data.bouts:
        return None
    rows = []
    for (series, opponent), bouts in _series(data.bouts).items():
        count = {outcome: sum(bout.outcome is outcome for bout in bouts) for outcome in BoutOutcome}
        over = len(bouts) - count[BoutOutcome.UNDECIDED]
        low, high = Rate(count[BoutOutcome.WIN], over).ci95
        wins = [bout.duration for bout in bouts if bout.outcome is BoutOutcome.WIN]
        rows.append(
            (
                series or "—",
                opponent,
                *(f"{number:,}" for number in (over, *(count[outcome] for outcome in OUTCOME_COLUMNS))),
                f"{count[BoutOutcome.WIN] / over:.3f}" if over else "—",
                f"{low:.3f} to {high:.3f}" if over else "—",
                f"{quantile(wins, 0.5):.2f} s" if wins else "—",
            )
        )
    head = ("Series", "Opponent", "Decided", "Won", "Lost", "Drawn", "Broken off", "Share won", "95% interval", "Median win")
    return ReportTable("Bouts", head, tuple(rows), frozenset(range(2, 10)))


def link_table(data: RunData) -> ReportTable:
    """Counters of the link, from both ends."""
    link = data.link
    rows = [
        ("Good frames received", f"{link.good:,}"),
        ("Lost or damaged on the way here", f"{link.lost:,} ({link.loss:.2%})"),
        ("Received twice", f"{link.duplicates:,}"),
        *((f"Rejected: {reason}", f"{count:,}") for reason, count in sorted(link.rejected.items())),
        ("Messages sent", f"{sum(link.sent.values()):,}"),
        ("Commands sent again for want of an answer", f"{link.retries:,}"),
        ("Bytes received, sent", f"{link.bytes_received:,}, {link.bytes_sent:,}"),
    ]
    if link.round_trips:
        middle, last = (quantile(link.round_trips, share) * 1e3 for share in (0.5, 0.99))
        rows.append((f"Time to an answer, of {len(link.round_trips):,}", f"median {middle:.1f} ms, 99 % {last:.1f} ms"))
    if link.robot is not None:
        told = link.robot
        rows += [
            ("The robot’s count of our frames: good", f"{told.good:,}"),
            ("… lost", f"{told.lost:,}"),
            ("… with a bad checksum, unknown", f"{told.bad_checksum:,}, {told.unknown:,}"),
            ("Starts of the robot so far", f"{told.boot_count:,}"),
        ]
    return ReportTable("Link", ("What", "How much"), tuple(rows), frozenset({1}))


def oddity_table(data: RunData) -> ReportTable | None:
    """What the log holds that could not be understood or drawn."""
    if not data.oddities:
        return None
    return ReportTable(
        "What this program could make nothing of", ("What the log holds",), tuple((text,) for text in data.oddities)
    )


def metadata_tables(data: RunData) -> list[ReportTable]:
    """The log's metadata, a table each."""
    names = {"config": "Configuration", "robot": "Robot", "run": "This run"}
    tables = [
        ReportTable(title, ("Name", "Value"), tuple(sorted(data.metadata[name].items())))
        for name, title in names.items()
        if data.metadata.get(name)
    ]
    if data.parameters:
        rows = tuple((name, f"{value:g}") for name, value in sorted(data.parameters.items()))
        tables.append(ReportTable("The robot’s parameters", ("Name", "Value"), rows, frozenset({1})))
    return tables


def chosen_caption(bouts: Sequence[BoutPath]) -> str:
    """What became of the bouts in the picture."""
    counts = [f"{sum(bout.outcome is outcome for bout in bouts)} {word}" for outcome, word in OUTCOME_WORDS.items()]
    return ", ".join(text for text in counts if not text.startswith("0 "))


def _series(bouts: Sequence[BoutPath]) -> dict[tuple[str, str], list[BoutPath]]:
    found: dict[tuple[str, str], list[BoutPath]] = {}
    for bout in bouts:
        found.setdefault((bout.series, bout.opponent_name), []).append(bout)
    return found


def _opponents(data: RunData) -> list[str]:
    seen = list(dict.fromkeys(bout.opponent_name for bout in data.bouts))
    told = data.advice.opponent if data.advice else ""
    if told and seen == [OpponentCode.JUNIOR.label]:
        return [told]  # a referee knows that it is a Junior, and not who plays it
    return [*seen[:MOST_NAMED], "others"] if len(seen) > MOST_NAMED else seen or ([told] if told else [])


def _time(seconds: float) -> str:
    return f"{seconds / 60:.1f} minutes" if seconds >= 120 else f"{seconds:.1f} s"
