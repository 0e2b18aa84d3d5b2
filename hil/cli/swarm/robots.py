"""`hil swarm list` and `hil swarm identify`: who the robots of a swarm are, and which is which."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.table import Table

from hil.cli import common
from hil.cli.links import YesOption, all_settled
from hil.cli.swarm import options  # noqa: TC001 - typer reads the annotations when it runs
from hil.jobs.swarm_robots import RobotOverview, robots_of, show_which
from hil.swarm.connecting import connect_swarm

EMULATED = "sim://swarm"


def list_robots(
    links: options.LinksArgument = None,
    *,
    yes: YesOption = False,
    signing_key: common.SigningKeyOption = None,
    as_json: common.JsonOption = False,
    config: common.ConfigOption = None,
) -> int:
    """List the micro-robots on one link or several: they are only looked at, and go on with what they do.

    Example: hil swarm list udpin://0.0.0.0:14550
    """
    del config
    links = all_settled(links, yes=yes, quiet=as_json, signing_key=signing_key)
    with connect_swarm(*(links or [EMULATED]), watch=True, signing_key=signing_key) as swarm:
        robots = robots_of(swarm)
    if as_json:
        common.print_json([robot.to_dict() for robot in robots])
    else:
        common.consoles(as_json=False).print(_table(robots))
    return 0


def identify(
    robot: Annotated[str, typer.Argument(metavar="ADDRESS", help="Which robot: NETWORK.ID, or ID where there is one network.")],
    links: options.LinksArgument = None,
    *,
    yes: YesOption = False,
    signing_key: common.SigningKeyOption = None,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,
) -> int:
    """Have one micro-robot turn 20 degrees to the left and to the right, to see which it is. The others are left alone.

    Example: hil swarm identify 7 udpin://0.0.0.0:14550
    """
    del config
    links = all_settled(links, yes=yes, quiet=quiet, signing_key=signing_key)
    with connect_swarm(*(links or [EMULATED]), watch=True, signing_key=signing_key) as swarm:
        if robot not in swarm.labels:
            raise common.UsageError(f"there is no robot {robot}; there are {', '.join(swarm.labels)}")
        show_which(swarm, swarm.labels.index(robot))
    if not quiet:
        typer.echo(f"Robot {robot} has turned left and right.")
    return 0


def _table(robots: list[RobotOverview]) -> Table:
    table = Table(box=None)
    for head in ("address", "unique id", "class", "ring", "battery", "fix", "fence", "armed"):
        table.add_column(head, overflow="fold")
    for one in robots:
        fence = "" if one.fence is None else "none" if not any(one.fence) else f"{2 * one.fence[0]:g} x {2 * one.fence[1]:g} m"
        table.add_row(
            one.address,
            one.uid,
            one.kind,
            "yes" if one.ring else "no",
            "" if one.battery is None else f"{one.battery:.2f} V",
            "never" if one.fix_age is None else f"{one.fix_age:.2f} s ago",
            fence,
            "" if one.armed is None else "yes" if one.armed else "no",
        )
    return table
