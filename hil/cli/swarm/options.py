"""Options that every verb of `hil swarm` has."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from hil.cli.completion import link_words
from hil.swarm.placing import StartPlace


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
    bool, typer.Option("--yes", help="Ask nothing: take what auto has found, move robots that no table is with.")
]
NoInputOption = Annotated[bool, typer.Option("--no-input", help="Ask nothing: what would have to be asked ends the run.")]
NoFenceOption = Annotated[
    bool, typer.Option("--no-fence", help="Robots that no table is with need no fence, though there is no wall either.")
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
