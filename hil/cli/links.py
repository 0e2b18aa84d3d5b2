"""The LINK of a command line: an address as it was written, the robot that is there (`auto`), or none: an emulated one."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, overload

import typer

from firmware_protocol.address import parse_address
from firmware_protocol.errors import AddressError, NoRobotError
from firmware_protocol.links.serial import list_ports
from hil.cli import common
from hil.cli.findings import lines_of
from hil.connecting.discovery import Status, survey
from hil.connecting.places import present
from hil.signing.key_file import load_key

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from hil.connecting.discovery import Finding
    from hil.connecting.listening import HeardRobot

AUTO: Final = "auto"
"""In place of an address: what answers at this machine's ports."""
MEANT: Final = tuple(f"Did you mean {start}" for start in ("/dev/", "can:", "serial:", "tcp:", "udp"))
"""An address that is written wrongly is known by these words, where a run or a log may be meant as well."""
LOOK: Final = 5.0
"""Longest look at all ports, in s."""
YesOption = Annotated[bool, typer.Option("--yes", "-y", help="With auto in place of LINK: take what answers, and do not ask.")]


@overload
def settled(link: str, *, yes: bool, quiet: bool, signing_key: Path | None = None) -> str: ...


@overload
def settled(link: None, *, yes: bool, quiet: bool, signing_key: Path | None = None) -> None: ...


@overload
def settled(link: str | None, *, yes: bool, quiet: bool, signing_key: Path | None = None) -> str | None: ...


def settled(link: str | None, *, yes: bool, quiet: bool, signing_key: Path | None = None) -> str | None:
    """The address of the robot that is meant.

    Args:
        link: As given: an address, a bare port, `auto`; None: a robot is to be emulated; of a port that is there all the
            same is told.
        yes: With `auto`: do not ask.
        quiet: Say nothing but what is asked.
        signing_key: Key file to recognise robots by.

    Returns:
        The address as a URL; None: a robot is to be emulated.

    Raises:
        AddressError: It is no address.
        NoRobotError: With `auto`: none answers.
        UsageError: With `auto`: several answer, nobody can be asked, or the robot is not to be taken.
        KeyFileError: The key file can't be used.
    """
    if link is None:
        if not quiet:
            _tell_of_ports()
        return None
    if link != AUTO:
        return parse_address(link).url
    found = [(f"{robot}", finding.address(robot)) for finding, robot in _usable(_answering(signing_key))]
    return _the_one(found, "robots", yes=yes)


def emulated_here(url: str) -> bool:
    """Whether the robots of an address are emulated in this process, in lock-step with it.

    Args:
        url: The address.

    Raises:
        AddressError: It is none.
    """
    return parse_address(url).scheme == "sim"


def is_link(text: str) -> bool:
    """Whether a link is meant where a run or a log may be named as well; a file or a folder that is there is none.

    Args:
        text: As given.

    Raises:
        AddressError: It is neither: an address that is written wrongly.
    """
    path = Path(text)
    if path.is_file() or path.is_dir():
        return False
    if text == AUTO or "://" in text:
        return True
    try:
        parse_address(text)
    except AddressError as error:
        if any(hint in str(error) for hint in MEANT):
            raise
        return False
    return True


def all_settled(links: Sequence[str] | None, *, yes: bool, quiet: bool, signing_key: Path | None = None) -> list[str] | None:
    """The addresses of the links that are meant; `auto` is the one link on which robots answer.

    Args:
        links: As given; None: robots are to be emulated.
        yes: As for `settled`, and what follows likewise.
        quiet: Likewise.
        signing_key: Likewise.

    Returns:
        The addresses as URLs; None: robots are to be emulated.

    Raises:
        AddressError: As by `settled`, and the others likewise.
    """
    if not links:
        settled(None, yes=yes, quiet=quiet)
        return None
    if AUTO not in links:
        return [parse_address(link).url for link in links]
    if len(links) > 1:
        raise common.UsageError("auto is the one link on which robots answer: name all links, or none beside it")
    found = {finding.url: f"{robot}" for finding, robot in _usable(_answering(signing_key))}
    return [_the_one([(words, url) for url, words in found.items()], "links with robots", yes=yes)]


def _answering(signing_key: Path | None) -> list[Finding]:
    """Who answers at all ports of this machine; where there is none to look at, or nobody answers, that is told.

    Raises:
        NoRobotError: Nobody answers.
    """
    key = load_key(signing_key) if signing_key else None
    places = present()
    findings = survey(places, LOOK, key=key) if places else []
    if any(finding.status is Status.ROBOT for finding in findings):
        return findings
    for finding in findings:
        _tell(lines_of(finding, signing_key))
    why = "no robot answers at any port" if places else "there is no serial port and no CAN interface"
    raise NoRobotError(f"{AUTO}: {why}. Plug the robot in and switch it on, or leave LINK out: a robot is emulated then")


def _usable(findings: Sequence[Finding]) -> list[tuple[Finding, HeardRobot]]:
    return [(finding, robot) for finding in findings for robot in finding.robots if robot.usable]


def _the_one(found: Sequence[tuple[str, str]], what: str, *, yes: bool) -> str:
    """The only one of what was found, once that is agreed to.

    Args:
        found: Words and address of each.
        what: Of what there may be too many.
        yes: It is agreed to.
    """
    if len(found) > 1:
        _tell(f"{url}    {words}" for words, url in found)
        raise common.UsageError(f"{AUTO}: there are {len(found)} {what}: name the one that is meant by its address")
    words, url = found[0]
    if yes:
        _tell([f"{words} at {url}"])
        return url
    if sys.stdin is None or not sys.stdin.isatty():
        raise common.UsageError(f"{AUTO}: {words} is at {url}. Nobody can be asked here: name it, or add --yes")
    if not typer.confirm(f"{words} is at {url}: take it?", default=True, err=True):
        raise common.UsageError("it was left alone: name the robot that is meant by its address")
    return url


def _tell_of_ports() -> None:
    """Say that there is a port, where there is one that a robot may be at: those of the main board are always there."""
    ports = [port.device for port in list_ports() if port.vendor is not None]
    if ports:
        are = "is" if len(ports) == 1 else "are"
        _tell([f"This robot is emulated. {', '.join(ports)} {are} there: name it, or write auto, for a robot at it."])


def _tell(lines: Iterable[str]) -> None:
    console = common.plain_console(stderr=True)
    for line in lines:
        console.print(line)
