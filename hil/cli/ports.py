"""`hil ports`: what could be connected to, what answers as a robot, and what to do about the rest."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from firmware_protocol.address import DEFAULT_BAUD
from hil.cli import common
from hil.cli.completion import link_words
from hil.cli.findings import lines_of
from hil.connecting.discovery import Finding, Status, survey
from hil.connecting.places import named, present
from hil.signing.key_file import load_key

if TYPE_CHECKING:
    from hil.connecting.places import Place


def ports(
    links: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="LINK",
            autocompletion=link_words,
            help="Addresses to look at instead: tcp://127.0.0.1:5760, can://socketcan/can0.",
        ),
    ] = None,
    *,
    probe: Annotated[bool, typer.Option("--probe/--no-probe", help="Open each and listen for a robot.")] = True,
    baud: Annotated[
        int, typer.Option("--baud", min=1, help="Rate to listen at first; others are tried after it.")
    ] = DEFAULT_BAUD,
    timeout: Annotated[
        float, typer.Option("--timeout", min=0.1, max=60, help="Longest look, in s; all are looked at together.")
    ] = 5.0,
    signing_key: Annotated[
        Path | None,
        typer.Option("--signing-key", metavar="FILE", help="Key file: recognise the robots that sign with it."),
    ] = None,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,  # noqa: ARG001 - handled while parsing
) -> int:
    """List serial ports and CAN interfaces, and say which answer as a robot. Nothing is moved, stopped or disarmed.

    A port that another program has open is left alone. Exit status 3 when no robot answers.

    Example: hil ports
    """
    console = common.consoles(as_json=as_json, quiet=quiet)
    places = named(links) if links else present(baud=baud)
    key = load_key(signing_key) if signing_key else None
    findings = survey(places, timeout, key=key) if probe else [_unprobed(place) for place in places]
    if as_json:
        common.print_json([_plain(finding) for finding in findings])
    else:
        for finding in findings:
            for line in lines_of(finding, signing_key):
                console.print(line, markup=False)
        if not findings:
            console.print(
                "There is no serial port and no CAN interface. Plug the robot in; or try an emulated one: "
                "hil emulate junior --link pty",
                markup=False,
            )
    found = any(finding.status is Status.ROBOT for finding in findings)
    return common.EXIT_DONE if found or not probe else common.EXIT_NO_ROBOT


def _unprobed(place: Place) -> Finding:
    if place.obstacle:
        return Finding(place, Status.UNAVAILABLE, place.url, reason=place.obstacle, remedy=place.remedy)
    return Finding(place, Status.NOT_PROBED, place.url)


def _plain(finding: Finding) -> dict[str, object]:
    place = finding.place
    return {
        "kind": place.kind,
        "device": place.device,
        "url": finding.url,
        "description": place.description,
        "serial_number": place.serial_number,
        "details": place.details,
        "status": str(finding.status),
        "robots": [
            {
                "url": finding.address(robot),
                "system": robot.system,
                "junior": robot.junior,
                "role": robot.role,
                "usable": robot.usable,
                "armed": robot.armed,
                "state": None if robot.state is None else robot.state.name.lower(),
                "firmware": robot.firmware,
                "protocol": robot.protocol,
                "uid": robot.uid,
                "battery": robot.battery,
                "signed": str(robot.signed),
            }
            for robot in finding.robots
        ],
        "reason": finding.reason,
        "remedy": finding.remedy,
    }
