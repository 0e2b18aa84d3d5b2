"""`hil check`: conformance of a robot against the protocol."""

from __future__ import annotations

from contextlib import ExitStack
from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table
from rich.text import Text

from firmware_protocol.address import parse_address
from firmware_protocol.wire import CAN, MAVLINK
from hil.cli import common
from hil.cli.running import running
from hil.cli.session import open_recorder, terminate_as_interrupt
from hil.conformance import CHECKS, LAST, Check, Outcome, Subject, Verdict, on_wire, perform
from hil.connecting import DEFAULT_URL, fault_option, number_option, open_address
from hil.key_file import load_key, open_signing
from hil.lines import need_full_rate

if TYPE_CHECKING:
    from rich.console import Console

_COLOURS = {Outcome.PASSED: "green", Outcome.FAILED: "bold red", Outcome.NOT_RUN: "dim"}
_WIRE_NAMES = {MAVLINK: "MAVLink", CAN: "CAN"}
_NAME_WIDTH = max(len(check.name) for check in (*CHECKS, LAST))


def check(
    link: common.LinkArgument = None,
    *,
    moving: Annotated[
        bool, typer.Option("--moving", help="Also run the checks in which the wheels turn: give it room.")
    ] = False,
    only: Annotated[
        list[str] | None, typer.Option("--only", metavar="NAME", help="Run this check; may be given several times.")
    ] = None,
    listing: Annotated[
        bool, typer.Option("--list", help="Print the checks and what each demands; no robot is needed.")
    ] = False,
    system: Annotated[
        int | None, typer.Option("--system", min=1, max=254, help="System id of the robot; the first that answers if left out.")
    ] = None,
    timeout: Annotated[float, typer.Option("--timeout", min=0.1, max=60, help="How long to wait for a robot, in s.")] = 5.0,
    signing_key: common.SigningKeyOption = None,
    seed: common.SeedOption = 1,
    out: common.OutOption = None,
    log: common.LogOption = None,
    no_log: common.NoLogOption = False,
    overwrite: common.OverwriteOption = False,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,  # noqa: ARG001 - handled while parsing
) -> int:
    """Check that a robot, physical or emulated, keeps the protocol. It is left disarmed, its parameters and memory as found.

    No wheel turns without --moving. Exit status 1: a check failed.

    Example: hil check serial:///dev/ttyACM0:115200 --moving
    """
    console = common.consoles(as_json=as_json, quiet=quiet)
    chosen = _chosen(only)
    if listing:
        _list(chosen or list(CHECKS), console, as_json=as_json)
        return common.EXIT_DONE
    url = link if link is not None else f"{DEFAULT_URL}?seed={seed}"
    address = parse_address(url)
    key = load_key(signing_key) if signing_key else None

    def told(verdict: Verdict) -> None:
        if not as_json and (not quiet or verdict.outcome is Outcome.FAILED):
            _tell(console, verdict)

    with ExitStack() as stack:
        run = stack.enter_context(
            running(
                "check",
                "emulated" if link is None else "robot",
                url=url,
                emulated_here=link is None,
                seed=seed,
                out=out,
                log=log,
                no_log=no_log or (log is None and out is None and not moving),
                overwrite=overwrite,
            )
        )
        stack.enter_context(terminate_as_interrupt())
        need_full_rate(address, fault_option(address), signed=key is not None)
        wire, clock, session = open_address(address, key)
        stack.callback(wire.close)
        signing = open_signing(key, wire, clock)
        taps = []
        if run.log is not None:
            config_told = {"verb": "check", "moving": moving, "seed": seed}
            taps.append(stack.enter_context(open_recorder(run, run.log, url, config_told, lockstep=wire.lockstep)))
        node = number_option(address, "node" if "node" in address.options else "system")
        robot = Subject(wire, clock, session=session, system=system or node, taps=taps, signing=signing)
        stack.callback(robot.close)
        robot.greet(timeout)
        if not quiet and not system:
            common.tell_others(robot.system, robot.others, url, partial(console.print, markup=False))
        verdicts = perform(robot, chosen or on_wire(CHECKS, robot.wire), LAST, moving=moving, told=told)
        failed = any(verdict.outcome is Outcome.FAILED for verdict in verdicts)
        run.finish({"summary": _summary(verdicts)}, common.EXIT_FELL_SHORT if failed else common.EXIT_DONE)
    with run.telling():
        if as_json:
            common.print_json([_plain(verdict) for verdict in verdicts])
        else:
            console.print(_summary(verdicts))
            if robot.lost or robot.spoilt:
                console.print(
                    f"On the way {robot.lost} frames were lost and {robot.spoilt} pieces damaged: on a bad line a check may "
                    "fail that the robot would pass."
                )
            if run.log is not None and not quiet:
                console.print(f"Log: {run.log}", markup=False)
    return run.ended()


def _chosen(only: list[str] | None) -> list[Check]:
    """The checks that were asked for by name, in the suite's order."""
    if not only:
        return []
    known = {check.name for check in CHECKS}
    for name in only:
        if name not in known:
            raise common.UsageError(f"there is no check {name!r}: hil check --list names them all")
    return [check for check in CHECKS if check.name in only]


def _list(checks: list[Check], console: Console, *, as_json: bool) -> None:
    if as_json:
        common.print_json(
            [
                {
                    "name": check.name,
                    "group": check.group,
                    "demands": check.demands,
                    "rule": check.rule,
                    "moving": check.moving,
                    "wire": check.wire or None,
                    "keyed": check.keyed,
                }
                for check in checks
            ]
        )
        return
    table = Table(box=None)
    for head in ("check", "about", "wheels turn", "over", "what the protocol demands"):
        table.add_column(head)
    for check in checks:
        over = _WIRE_NAMES.get(check.wire, "") + (", with a key" if check.keyed else "")
        table.add_row(check.name, check.group, "yes" if check.moving else "", over, check.demands)
    console.print(table)


def _tell(console: Console, verdict: Verdict) -> None:
    word = f"{verdict.outcome.value:8}"
    console.print(f"{verdict.check.name:{_NAME_WIDTH}}  ", Text(word, _COLOURS[verdict.outcome]), f"  {verdict.detail}", sep="")
    if verdict.outcome is Outcome.FAILED:
        console.print(f"{'':{_NAME_WIDTH}}  demanded: {verdict.check.demands} ({verdict.check.rule})", markup=False)


def _summary(verdicts: list[Verdict]) -> str:
    counts = {outcome: sum(verdict.outcome is outcome for verdict in verdicts) for outcome in Outcome}
    return ", ".join(f"{count} {outcome.value}" for outcome, count in counts.items() if count)


def _plain(verdict: Verdict) -> dict[str, object]:
    return {"name": verdict.check.name, "passed": verdict.passed, "detail": verdict.detail}
