"""Several coachings and their team exam in words and tables."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.report.learning_figures import category_name
from hil.report.report_table import ReportTable, counted

if TYPE_CHECKING:
    from hil.mcaplog.records import CoachedRunRecord, TeamVerdictRecord
    from hil.report.run_data import RunData


def team_said(data: RunData) -> str:
    """What the runs did, and what was made of them.

    Args:
        data: The run, in whose log others are told of.
    """
    runs = data.coached
    maneuvers, bouts = sum(run.maneuvers for run in runs), sum(run.bouts for run in runs)
    minutes = sum(run.robot_seconds for run in runs) / 60
    best = next((verdict.run for verdict in data.verdicts if verdict.kept and not verdict.current), None)
    text = (
        f"Pal coached {counted(len(runs), 'robot', 'robots')}, apart: {maneuvers:,} maneuvers in {bouts:,} bouts, "
        f"{minutes:.1f} minutes of robot time."
    )
    if best is None:
        return text
    taken = [verdict for verdict in data.verdicts if verdict.kept and verdict.current]
    text += f" In the team exam, whole bouts from the same poses for all, run {best} did best."
    if not taken:
        return f"{text} Nothing that another run had learnt served its advice better."
    parts = [f"what run {verdict.run} does when it is “{_situation(verdict)}”" for verdict in taken]
    return f"{text} Its advice became better with {' and with '.join(parts)}."


def runs_table(data: RunData) -> ReportTable | None:
    """The runs, a row each."""
    if not data.coached:
        return None
    whole = {verdict.run: verdict for verdict in data.verdicts if not verdict.current}
    rows = tuple(_row(run, whole.get(run.number)) for run in data.coached)
    head = ("Run", "Seed", "Maneuvers", "Bouts", "Won while it learnt", "Robot time", "Won in the exam", "Mean time of a bout")
    return ReportTable("The runs", head, rows, frozenset(range(8)))


def _row(run: CoachedRunRecord, verdict: TeamVerdictRecord | None) -> tuple[str, ...]:
    exam = ("—", "—")
    if verdict is not None and verdict.trials > 0:
        exam = (f"{verdict.wins:,} of {verdict.trials:,}", f"{verdict.seconds / verdict.trials:.2f} s")
    return (
        f"{run.number:,}",
        f"{run.seed}",
        f"{run.maneuvers:,}",
        f"{run.bouts:,}",
        f"{run.wins:,}",
        f"{run.robot_seconds / 60:.1f} min",
        *exam,
    )


def exam_table(data: RunData) -> ReportTable | None:
    """What of other runs was tried in the best advice, a row each."""
    tried = [verdict for verdict in data.verdicts if verdict.current]
    if not tried:
        return None
    rows = tuple(
        (
            _situation(verdict),
            f"{verdict.run:,}",
            f"{verdict.wins:,} of {verdict.trials:,}",
            f"{verdict.score:.3f}",
            "yes" if verdict.kept else "—",
        )
        for verdict in tried
    )
    head = ("The eyes that see it", "Maneuver of run", "Won with it", "Score", "Taken")
    return ReportTable("Maneuvers of other runs, tried in the best advice", head, rows, frozenset({1, 2, 3}))


def _situation(verdict: TeamVerdictRecord) -> str:
    return category_name((verdict.previous, verdict.current))
