"""`hil check`: conformance of a robot against the protocol."""

from __future__ import annotations

import re
from textwrap import fill
from typing import TYPE_CHECKING, Annotated, Final

import typer
from rich.table import Table
from rich.text import Text

from firmware_protocol.near import did_you_mean
from firmware_protocol.wire.fields import CAN, MAVLINK
from hil.cli import common, links
from hil.cli.running import running
from hil.cli.stage import LiveStage
from hil.conformance import CHECKS, LAST, Check, CheckOutcome, Verdict
from hil.conformance.page import wheels_of
from hil.connecting.connecting import DEFAULT_URL
from hil.jobs.check import MOST_SYSTEM, CheckJob, chosen_checks

if TYPE_CHECKING:
    from rich.console import Console

_COLOURS = {
    CheckOutcome.PASSED: "green",
    CheckOutcome.FAILED: "bold red",
    CheckOutcome.NOT_RUN: "dim",
    CheckOutcome.OTHER_ROLE: "dim",
}
_WIRE_NAMES = {MAVLINK: "MAVLink", CAN: "CAN"}
_ADDRESS: Final = re.compile(r"(1\.)?(?P<id>[0-9]{1,3})")
TABLE_WIDTH: Final = 140
"""A terminal of fewer columns has no room for the table of checks."""
_NAME_WIDTH = max(len(check.name) for check in (*CHECKS, LAST))


def check_names() -> list[str]:
    """Names of the checks, for a shell that completes."""
    return [check.name for check in CHECKS]


def check(
    link: common.LinkArgument = None,
    *,
    moving: Annotated[
        bool, typer.Option("--moving", help="Also run the checks in which the wheels turn: give it room.")
    ] = False,
    only: Annotated[
        list[str] | None,
        typer.Option("--only", metavar="NAME", autocompletion=check_names, help="Run this check; may be given several times."),
    ] = None,
    listing: Annotated[
        bool, typer.Option("--list", help="Print the checks and what each demands; no robot is needed.")
    ] = False,
    system: Annotated[
        int | None, typer.Option("--system", min=1, max=254, help="System id of the robot; the first that answers if left out.")
    ] = None,
    second: Annotated[
        str | None, typer.Option("--with", metavar="ADDRESS", help="Another robot on the link, for the checks that need two.")
    ] = None,
    timeout: Annotated[float, typer.Option("--timeout", min=0.1, max=60, help="How long to wait for a robot, in s.")] = 5.0,
    yes: links.YesOption = False,
    signing_key: common.SigningKeyOption = None,
    seed: common.SeedOption = 1,
    out: common.OutOption = None,
    log: common.LogOption = None,
    no_log: common.NoLogOption = False,
    overwrite: common.OverwriteOption = False,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,
) -> int:
    """Check that a robot, physical or emulated, keeps the protocol. It is left disarmed, its parameters and memory as found.

    No wheel turns without --moving. Exit status 1: a check failed.

    Example: hil check /dev/ttyACM0 --moving
    """
    console = common.consoles(as_json=as_json, quiet=quiet)
    named = _named(only)
    if listing:
        _list(chosen_checks(named) or list(CHECKS), console, as_json=as_json)
        return common.EXIT_DONE
    link = links.settled(link, yes=yes, quiet=quiet, signing_key=signing_key)
    url = link if link is not None else f"{DEFAULT_URL}?seed={seed}"

    def told(verdict: Verdict) -> None:
        if not as_json and (not quiet or verdict.outcome is CheckOutcome.FAILED):
            _tell(console, verdict)

    job = CheckJob(moving, named, system, _second(second, system), timeout, seed, told=told)
    with running(
        "check",
        "emulated" if link is None else "robot",
        url=url,
        emulated_here=link is None,
        seed=seed,
        signing_key=signing_key,
        out=out,
        log=log,
        no_log=no_log or (log is None and out is None and not moving),
        overwrite=overwrite,
    ) as run:
        checked = job.perform(LiveStage(run, job, url, console, quiet=quiet, signing_key=signing_key, options=config))
        summary = _summary(checked.verdicts)
        run.finish({"summary": summary}, common.EXIT_FELL_SHORT if checked.failed else common.EXIT_DONE)
    with run.telling():
        if as_json:
            common.print_json(checked.facts())
        else:
            console.print(summary)
            if checked.lost or checked.spoilt:
                console.print(
                    f"On the way {checked.lost} frames were lost and {checked.spoilt} pieces damaged: on a bad line a check "
                    "may fail that the robot would pass."
                )
            if run.log is not None and not quiet:
                console.print(f"Log: {run.log}", markup=False)
    return run.ended()


def _named(only: list[str] | None) -> tuple[str, ...]:
    """The checks that were asked for by name."""
    named = tuple(only or ())
    try:
        chosen_checks(named)
    except ValueError as error:
        meant = did_you_mean(str(error), [check.name for check in CHECKS])
        raise common.UsageError(f"there is no check {str(error)!r}: hil check --list names them all{meant}") from error
    return named


def _second(address: str | None, system: int | None) -> int | None:
    """The system id in the address of a second robot: ID, or 1.ID, since a link is one network."""
    if address is None:
        return None
    found = _ADDRESS.fullmatch(address)
    number = int(found["id"]) if found else 0
    if not 1 <= number <= MOST_SYSTEM:
        raise common.UsageError(f"--with {address}: write the system id of another robot on the link, 1 to {MOST_SYSTEM}")
    if number == system:
        raise common.UsageError(f"--with {address}: that is the robot that is checked; name another one")
    return number


def _list(checks: list[Check], console: Console, *, as_json: bool) -> None:
    if as_json:
        common.print_json(
            [
                {
                    "name": check.name,
                    "group": check.group,
                    "demands": check.demands,
                    "rule": check.rule,
                    "role": check.role or None,
                    "moving": check.moving,
                    "motion": check.motion,
                    "room": check.room,
                    "second": check.second,
                    "wire": check.wire or None,
                    "keyed": check.keyed,
                }
                for check in checks
            ]
        )
        return
    if console.width < TABLE_WIDTH:  # six columns would be a few letters each
        for check in checks:
            about = "; ".join(filter(None, [check.group, check.role, _over(check), _turning(check)]))
            for text, indent in ((f"{check.name}  ({about})", ""), (check.demands, "    ")):
                console.print(fill(text, console.width, initial_indent=indent, subsequent_indent="    "))
        return
    table = Table(box=None)
    for head in ("check", "about", "for", "wheels turn", "over", "what the protocol demands"):
        table.add_column(head, no_wrap=head == "check")
    for check in checks:
        table.add_row(check.name, check.group, check.role, wheels_of(check), _over(check), check.demands)
    console.print(table)


def _over(check: Check) -> str:
    return _WIRE_NAMES.get(check.wire, "") + (", with a key" if check.keyed else "")


def _turning(check: Check) -> str:
    turn = wheels_of(check)
    return f"wheels turn: {turn}" if turn else ""


def _tell(console: Console, verdict: Verdict) -> None:
    if verdict.outcome is CheckOutcome.OTHER_ROLE:
        console.print(f"{verdict.check.name:{_NAME_WIDTH}}  ", Text(verdict.outcome.value, _COLOURS[verdict.outcome]), sep="")
        return
    word = f"{verdict.outcome.value:8}"
    console.print(f"{verdict.check.name:{_NAME_WIDTH}}  ", Text(word, _COLOURS[verdict.outcome]), f"  {verdict.detail}", sep="")
    if verdict.outcome is CheckOutcome.FAILED:
        console.print(f"{'':{_NAME_WIDTH}}  demanded: {verdict.check.demands} ({verdict.check.rule})", markup=False)


def _summary(verdicts: list[Verdict]) -> str:
    counts = {outcome: sum(verdict.outcome is outcome for verdict in verdicts) for outcome in CheckOutcome}
    return ", ".join(f"{count} {outcome.value}" for outcome, count in counts.items() if count)
