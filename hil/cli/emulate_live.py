"""`--live` of `hil emulate`: the robots' side, where they have no stop, but power, and hands that lift them."""

from __future__ import annotations

import shlex
import sys
import threading
import time
from contextlib import contextmanager
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from hil.cli import common

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from rich.console import Console

    from hil.cli.live import LivePage
    from hil.look.live.robot_side import Handled
    from simdevice.serving.endpoints import Endpoint
    from simdevice.sumo.crowd import Crowd
    from simdevice.sumo.world import World
    from simdevice.swarm.world import SwarmWorld

LiveOption = Annotated[
    bool, typer.Option("--live", help="Show the robots in a web browser, with buttons for their power, and to lift them.")
]


class Served(NamedTuple):
    """What is served where.

    Attributes:
        endpoints: Where clients come.
        stopped: Asked before every turn of the server.
    """

    endpoints: Sequence[Endpoint]
    stopped: Callable[[], bool]


class HandledJunior:
    """One Junior in its ring.

    Args:
        world: It.
    """

    count = 1
    liftable = True

    def __init__(self, world: World) -> None:
        self._world = world

    def power(self, *, on: bool) -> None:
        """Switch it on, or off."""
        if on:
            self._world.switch_on()
        else:
            self._world.switch_off()

    def hold_up(self, *, up: bool) -> None:
        """Lift it off its ring, or put it back."""
        if up:
            self._world.lift()
        else:
            self._world.put_down()


class HandledCrowd:
    """Several Juniors, each in a ring of its own.

    Args:
        world: They.
    """

    liftable = True

    def __init__(self, world: Crowd) -> None:
        self._world = world
        self.count = len(world.members)

    def power(self, *, on: bool) -> None:
        """Switch all on, or off."""
        do = self._world.switch_on if on else self._world.switch_off
        for system in self._world.members:
            do(system)

    def hold_up(self, *, up: bool) -> None:
        """Lift all off their rings, or put them back."""
        do = self._world.lift if up else self._world.put_down
        for system in self._world.members:
            do(system)


def juniors(world: World | Crowd) -> Handled:
    """Juniors as somebody beside them handles them.

    Args:
        world: One, or several.
    """
    from simdevice.sumo.crowd import Crowd  # noqa: PLC0415 - pymunk takes a moment to load

    return HandledCrowd(world) if isinstance(world, Crowd) else HandledJunior(world)


class HandledSwarm:
    """Micro-robots on their table.

    Args:
        world: They.
    """

    liftable = False

    def __init__(self, world: SwarmWorld) -> None:
        self._world = world
        self.count = world.settings.count

    def power(self, *, on: bool) -> None:
        """Switch all on, or off."""
        do = self._world.switch_on if on else self._world.switch_off
        for row in range(self.count):
            do(row)

    def hold_up(self, *, up: bool) -> None:
        """Nobody lifts them."""


@contextmanager
def shown(page: LivePage | None, robots: Handled, endpoints: Sequence[Endpoint], console: Console) -> Iterator[Served]:
    """Inside, what is served is shown on a page, where it is to be.

    Args:
        page: How; None: it is not shown.
        robots: What is done by hand is done to them.
        endpoints: Where clients come.
        console: Where the page's address goes.
    """
    if page is None:
        yield Served(endpoints, threading.Event().is_set)
        return
    from hil.look.live.robot_side import RobotSide  # noqa: PLC0415 - only where somebody looks on

    about = {
        "command": shlex.join(["hil", *sys.argv[1:]]),
        "started": datetime.fromtimestamp(time.time(), UTC).isoformat(),
    }
    networks = [(endpoint.url, endpoint.wire) for endpoint in endpoints]
    side = RobotSide(robots, networks, about, public=page.public, failed=common.complain)
    page.announce(side.recorder, console)

    def stopped() -> bool:
        side.attend()
        return False

    try:
        yield Served([side.overheard(endpoint, number) for number, endpoint in enumerate(endpoints)], stopped)
    finally:
        side.close()
