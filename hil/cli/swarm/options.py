"""Options that every verb of `hil swarm` has."""

from __future__ import annotations

from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hil.cli import common
from hil.cli.completion import link_words
from hil.swarm.placing import StartPlace
from hil.working import Crew, open_crew
from hil.working.cluster import scheduler_address

if TYPE_CHECKING:
    from collections.abc import Iterator


class RingName(StrEnum):
    """Where sights come from."""

    ROBOT = "robot"
    POSITIONS = "positions"


LinksArgument = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="LINK",
        autocompletion=link_words,
        help="Addresses of the links that the robots are on: /dev/ttyUSB0, tcp://127.0.0.1:5760, "
        "sim://swarm?rangers=25&wilds=8; auto: the one link on which robots answer. "
        "Left out: an emulated table in this process.",
        show_default=False,
    ),
]
PlaceOption = Annotated[
    StartPlace | None,
    typer.Option("--place", help="How robots get to their start places [default: table; drive where there is none]"),
]
QUORUM = 0.5
QuorumOption = Annotated[
    float, typer.Option("--quorum", min=0, max=1, metavar="SHARE", help="Least share of each class that must be there.")
]
SpareOption = Annotated[
    bool, typer.Option("--spare", help="Robots beyond what the mission needs stand by for those that are missing.")
]
DeadlineOption = Annotated[
    float | None,
    typer.Option(
        "--deadline",
        min=0.05,
        max=86400,
        metavar="SECONDS",
        help="Of a round of moves, instead of as long as the robots may take.",
    ),
]
RingOption = Annotated[
    RingName | None,
    typer.Option(
        "--ring",
        help="Whom robots sense: by their own rings, or reckoned from all positions "
        "[default: robot where all have a ring, else positions]",
    ),
]
PosesOption = Annotated[
    str | None,
    typer.Option(
        "--poses",
        metavar="udpin://HOST:PORT",
        help="Where a camera's program tells where robots are: lines NETWORK ID x y heading age_ms, in m and rad.",
    ),
]
YesOption = Annotated[
    bool, typer.Option("--yes", help="Ask nothing: take what auto has found, move robots that stand on no emulated table.")
]
NoInputOption = Annotated[bool, typer.Option("--no-input", help="Ask nothing: what would have to be asked ends the run.")]
NoFenceOption = Annotated[
    bool,
    typer.Option("--no-fence", help="Robots that stand on no emulated table need no fence, even without a wall."),
]
SeedsOption = Annotated[int, typer.Option("--seeds", min=1, max=100_000, help="Number of seeds, from --seed on.")]
ResumeOption = Annotated[
    bool, typer.Option("--resume", help="Go on with the newest run of the same links that did not finish.")
]
ResumeFromOption = Annotated[
    Path | None, typer.Option("--resume-from", metavar="RUN|FILE", help="Go on with this run, or from this checkpoint.")
]
CheckpointOption = Annotated[
    Path | None, typer.Option("--checkpoint", metavar="FILE", help="Instead of checkpoint.json in the run's folder.")
]
ReportOption = Annotated[bool, typer.Option("--report/--no-report", help="Draw a report of the log at the end.")]
WorkersOption = Annotated[
    int | None,
    common.workers_option(
        "Play in N processes side by side, each run on an emulated table of its own: the same result for every N."
    ),
]
SchedulerOption = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        metavar="tcp://HOST:PORT",
        help="Have the workers of this Dask scheduler play instead, with the same result; they run programs as their users, so "
        "let it be on machines of yours.",
    ),
]


@contextmanager
def crew_of(workers: int | None, scheduler: str | None) -> Iterator[Crew | None]:
    """The workers that are to play; None where this process plays.

    Args:
        workers: As given.
        scheduler: As given.

    Yields:
        The workers.

    Raises:
        AddressError: That is no address of a scheduler.
        WorkerError: There is no such cluster, or a worker of it is of another version.
    """
    if workers is None and scheduler is None:
        yield None
        return
    with open_crew(workers or 1, scheduler) as crew:
        yield crew


def check_side_by_side(
    links: list[str] | None,
    *,
    workers: int | None,
    scheduler: str | None,
    place: StartPlace | None = None,
    poses: str | None = None,
    signing_key: Path | None = None,
) -> None:
    """See that what is asked for can be had by workers, where these are asked for, on emulated tables that only they know.

    Args:
        links: As given.
        workers: As given.
        scheduler: As given.
        place: As given.
        poses: As given.
        signing_key: As given.

    Raises:
        AddressError: That is no address of a scheduler.
        UsageError: Something can't.
    """
    if workers is None and scheduler is None:
        return
    if scheduler is not None:
        scheduler_address(scheduler)
        if workers is not None:
            raise common.UsageError("--workers starts processes here, and --scheduler has its own: leave one of them out")
    if links:
        raise common.UsageError(
            f"--workers and --scheduler play each run on an emulated table of its own, and the robots at {' '.join(links)} are "
            "there once: leave the option out, or the links"
        )
    if place not in {None, StartPlace.TABLE}:
        raise common.UsageError(f"--place {place} is for robots that are there; with --workers or --scheduler leave it out")
    for name, value in (("--poses", poses), ("--signing-key", signing_key)):
        if value is not None:
            raise common.UsageError(f"{name} is for a link; with --workers or --scheduler there is none: leave it out")
