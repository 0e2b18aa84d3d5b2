"""How many robots `hil coach` coaches: several where they are emulated here and nothing that is asked for is of one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final
from urllib.parse import urlencode

from firmware_protocol.address import parse_address
from hil.cli import common
from hil.cli.coach_begun import check_begun
from hil.cli.swarm import options
from hil.jobs.team import USUAL_RUNS
from hil.seeds import run_seed
from simdevice.sumo.conditions import CONDITIONS

if TYPE_CHECKING:
    import typer
    from rich.console import Console

    from hil.cli.coach_begun import BegunTeam

OF_ONE: Final = {
    "live": "shows one robot",
    "share": "shares the link of one robot",
    "signing_key": "signs on the link of one robot",
    "checkpoint": "names the checkpoint of one run",
    "reset": "is for a robot with a person beside it",
    "judge": "is for a robot with a person beside it",
}
"""Options of a run that has one robot, and why it has but one."""
ALIKE: Final = frozenset(("opponent", "seed", "wire", "vary", *CONDITIONS))
"""Options of the address of an emulated robot of which there may be several: with others one robot is rehearsed."""


@dataclass(frozen=True)
class RunsWanted:
    """How many robots are to be coached apart.

    Attributes:
        number: So many.
        why_one: Why it is one, where several could be had by leaving something out, in words; else empty.
    """

    number: int
    why_one: str = ""

    def tell(self, console: Console, *, quiet: bool) -> None:
        """Say why it is one, and how to have several.

        Args:
            console: Where to.
            quiet: Nothing but results is wanted.
        """
        if self.why_one and not quiet:
            several = f"without that {USUAL_RUNS} are, and one advice is made of what they learnt"
            console.print(f"One robot is coached, since {self.why_one}: {several}.", markup=False)


def runs_wanted(context: typer.Context, runs: int | None, link: str | None, begun: BegunTeam | None) -> RunsWanted:
    """How many runs are wanted.

    Args:
        context: The command line.
        runs: How many were asked for; None: as many as usual.
        link: Address of the robot; None is an emulated robot in this process.
        begun: Runs that are gone on with; None: there are none.

    Raises:
        AddressError: The address is none.
        UsageError: Several are asked for, and there is but one of that robot, or something is asked for that several do not
            have, or that they were not begun with.
    """
    if begun is not None:
        check_begun(context, begun)
        wanted = RunsWanted(len(begun.job.urls))
    else:
        wanted = RunsWanted(runs) if runs is not None else _usual(context, link)
    if wanted.number > 1 or begun is not None:
        _check_several(context, link, begun=begun is not None)
        options.check_side_by_side(None, workers=context.params["workers"], scheduler=context.params["scheduler"])
    elif context.params["scheduler"] is not None:
        raise common.UsageError("--scheduler is for several runs, and this is one: leave one of the two out")
    return wanted


def _usual(context: typer.Context, link: str | None) -> RunsWanted:
    """As many as there are where nobody has said how many."""
    if link is not None:
        address = parse_address(link)
        if address.scheme != "sim":
            return RunsWanted(1)
        rehearsed = [name for name in address.options if name not in ALIKE]
        if rehearsed:
            return RunsWanted(1, f"{rehearsed[0]} in the address is of one robot")
    if context.params["resume"] or context.params["resume_from"] is not None:
        return RunsWanted(1)
    found = [f"--{name.replace('_', '-')} {why}" for name, why in OF_ONE.items() if context.params[name]]
    return RunsWanted(1, found[0]) if found else RunsWanted(USUAL_RUNS)


def _check_several(context: typer.Context, link: str | None, *, begun: bool) -> None:
    """See that there can be several runs, which may have been begun already."""
    if link is not None and parse_address(link).scheme != "sim":
        raise common.UsageError(f"--runs coaches several robots at once, and there is one at {link}: leave one of the two out")
    for name, why in OF_ONE.items():
        if context.params[name]:
            option = f"--{name.replace('_', '-')}"
            raise common.UsageError(f"{option} {why}, and --runs makes several: leave one of the two out")
    if not begun and (context.params["resume"] or context.params["resume_from"] is not None):
        raise common.UsageError(
            "what was begun as one run is gone on with as one: leave --runs out, or begin anew without --resume"
        )


def opponent_of(link: str | None, opponent: str | None) -> str:
    """The opponent of several runs.

    Args:
        link: Address of the emulated robots; None: they have no other than usual.
        opponent: As asked for; None takes that of the address.
    """
    return opponent or (parse_address(link).options.get("opponent") if link else None) or "flat-light"


def urls_of(link: str | None, opponent: str, seed: int, number: int) -> tuple[str, ...]:
    """The addresses of the emulated robots of several runs: each has noise of its own, unless one is asked for.

    Args:
        link: Address that all of them are like; None: an emulated robot as usual.
        opponent: Name of their opponent.
        seed: Seed of it all.
        number: How many.
    """
    if link is None:
        return tuple(common.url_of(None, opponent, run_seed(seed, run)) for run in range(1, number + 1))
    address = parse_address(link)
    options = {**address.options, "opponent": opponent}
    each = [{"seed": str(run_seed(seed, run)), **options} for run in range(1, number + 1)]
    return tuple(f"{address.scheme}://{address.target}?{urlencode(one, safe='/:,@;+')}" for one in each)
