"""`hil coach --from`: the advice that a coaching begins from, and whether it can."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hil import runs
from hil.cli import common
from hil.jobs.coach import Reset
from hil.sumo.advice_file import load_advice
from hil.sumo.challenging import fitting

if TYPE_CHECKING:
    from pal_advisor.maneuvers import Advice, PalSettings

FromOption = Annotated[
    Path | None,
    typer.Option(
        "--from",
        metavar="RUN|FILE",
        help="Begin anew from this advice, which stays unless what is learnt then wins a challenge: 10 to 40 bouts in turn.",
    ),
]


def beside(advice: Path) -> Path:
    """Where what was learnt goes, where the advice stays that was begun from.

    Args:
        advice: Where the advice goes.
    """
    return advice.with_name(f"learnt-{advice.name}")


def given_advice(path: Path | None, settings: PalSettings, *, resumes: bool, reset: Reset | None = None) -> Advice | None:
    """The advice that a coaching is to begin from.

    Args:
        path: Its file, or the folder of the run that made it; None: it is to begin from none.
        settings: How Pal is to coach.
        resumes: A run is to be gone on with.
        reset: How the ring is set up between bouts.

    Raises:
        RunError: There is none in that folder.
        AdviceFileError: The file can't be read, or is no advice.
        UsageError: It can't be begun from as it was asked for.
    """
    if path is None:
        return None
    if resumes:
        raise common.UsageError(
            "--from begins anew from an advice, and --resume goes on with a coaching as it was begun: leave one of the two out"
        )
    if reset is Reset.AUTO:
        raise common.UsageError(
            "--from needs somebody who sees bouts won, and with --reset auto nobody does: use --reset ask or --judge"
        )
    file = runs.file_of(path, runs.ADVICE)
    given = load_advice(file)
    if unlike := fitting(given, settings):
        raise common.UsageError(f"no coaching can begin from {file} as asked for: {unlike}")
    return given
