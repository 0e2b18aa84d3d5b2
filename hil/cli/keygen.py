"""`hil keygen` and `hil key`: make a signing key, and give it to a robot or take it away."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from firmware_protocol.address import parse_address
from firmware_protocol.errors import NoRobotError, RefusedError
from hil.cli import common, links
from hil.connecting.connecting import connect_as
from hil.connecting.handle import RobotHandle
from hil.signing.key_file import create_key, load_key
from hil.signing.keying import give_key


def keygen(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Where the key goes; nothing may be there.")],
    *,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,  # noqa: ARG001 - handled while parsing
) -> None:
    """Make a signing key: a file that only you can read. Whoever has it can command the robots that have it.

    Example: hil keygen robots.key
    """
    create_key(file)
    if as_json:
        common.print_json({"file": str(file)})
    elif not quiet:
        typer.echo(f"A new signing key is in {file}: keep it secret, and keep a copy. Next, by cable:")
        typer.echo(f"    hil key LINK --install {file}")
        typer.echo(f"From then on add --signing-key {file} to every command. An emulated robot takes that option too.")


def key(
    link: common.RobotArgument,
    *,
    install: Annotated[
        Path | None, typer.Option("--install", metavar="FILE", help="Give the robot this key (hil keygen makes one).")
    ] = None,
    remove: Annotated[bool, typer.Option("--remove", help="Take its key away: it believes everybody again.")] = False,
    yes: links.YesOption = False,
    signing_key: Annotated[
        Path | None, typer.Option("--signing-key", metavar="FILE", help="The key that the robot has now, if it has one.")
    ] = None,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,  # noqa: ARG001 - handled while parsing
) -> None:
    """Give a robot a signing key, change it, or take it away. The robot keeps it when it is switched off.

    The key passes the line as it is: do this over a cable, not by radio.

    Example: hil key /dev/ttyACM0 --install robots.key
    """
    if (install is None) == (not remove):
        raise common.UsageError("say what to do: --install FILE or --remove")
    link = links.settled(link, yes=yes, quiet=quiet, signing_key=signing_key)
    if parse_address(link).scheme == "sim":
        raise common.UsageError("a robot at sim:// ends with this program: there give --signing-key to the command itself")
    new = load_key(install) if install else None
    with connect_as(RobotHandle, link, signing_key=signing_key) as robot:
        give_key(robot, new)
    try:
        with connect_as(RobotHandle, link, signing_key=new) as robot:
            who, system = robot.description, robot.peer.system
    except NoRobotError as error:
        why = "its firmware may be built without signing, or the line lost the message"
        raise RefusedError("the new key" if new else "to give up its key", f"{why} ({error})") from error
    if as_json:
        common.print_json({"robot": who, "system": system, "signs": new is not None})
    elif not quiet:
        typer.echo(f"{who}: {'signs with the new key' if new else 'has no key any more'}.")
