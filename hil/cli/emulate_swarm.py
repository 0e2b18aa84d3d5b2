"""`hil emulate swarm`: serves emulated micro-robots and their table in real time."""

from __future__ import annotations

import os
import shlex
import socket
from contextlib import ExitStack, closing
from dataclasses import replace
from enum import IntEnum
from typing import TYPE_CHECKING, Annotated

import typer

from firmware_protocol.address import parse_address
from firmware_protocol.errors import AddressError, FaultSpecError
from hil.bridge.clock import MonotonicClock
from hil.cli import common
from hil.cli import live as live_options
from hil.cli.emulate_live import HandledSwarm, LiveOption, shown
from hil.connecting.swarm_address import rooms_of, size_of
from hil.files.fault_file import read_faults
from hil.files.profile_file import ProfileFileError, read_profile
from hil.terminal.interrupts import interrupts

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.faults.spec import FaultSpec
    from simdevice.serving.endpoints import Endpoint
    from simdevice.swarm.settings import SwarmSettings
    from simdevice.swarm.world import SwarmWorld

BAUD = 921600
"""Rate of a pty, unless another is asked for, in bit/s: many robots share it."""
_RANGERS, _WILDS = 25, 8


class Period(IntEnum):
    """Control periods that a table may have, in ms."""

    SHORT = 5
    LONG = 10


def swarm(
    *,
    rangers: Annotated[int | None, typer.Option("--rangers", min=0, help=f"Number of RANGERs ({_RANGERS}).")] = None,
    wilds: Annotated[int | None, typer.Option("--wilds", min=0, help=f"Number of WILDs ({_WILDS}).")] = None,
    count: Annotated[int | None, typer.Option("--count", min=1, help="So many robots, all of them RANGERs, instead.")] = None,
    networks: Annotated[int, typer.Option("--networks", min=1, help="On how many networks they are.")] = 1,
    link: Annotated[
        list[str] | None,
        typer.Option(
            "--link",
            help="Where a network is served: pty, pty:57600, tcp://127.0.0.1:5760, udp://127.0.0.1:14550, slcan or can://.... "
            "Once for each network, or once with a port that is counted up.",
        ),
    ] = None,
    wall: Annotated[bool, typer.Option("--wall", help="A wall runs round the table.")] = False,
    size: Annotated[str | None, typer.Option("--size", metavar="W[,H]", help="Size of the table, in m. [default: 2.0]")] = None,
    room: Annotated[
        list[str] | None,
        typer.Option("--room", metavar="NAME|FILE", help="A room stands on it: default, narrow, mixed, or an image."),
    ] = None,
    noise: Annotated[
        str, typer.Option("--noise", metavar="NAME|FILE", help="default, none, or a device profile FILE.toml.")
    ] = "default",
    dropout: Annotated[
        float | None, typer.Option("--dropout", min=0.0, max=1.0, help="Probability that fixes drop out within a second.")
    ] = None,
    occlusion: Annotated[bool, typer.Option("--occlusion", help="Who stands behind something is not seen by a ring.")] = False,
    ring: Annotated[bool, typer.Option("--ring/--no-ring", help="The robots have a ring of sensors.")] = True,
    period: Annotated[int, typer.Option("--period", help="Control period, 5 or 10 ms.")] = Period.SHORT,
    speed: Annotated[float, typer.Option("--speed", min=0.01, max=100, help="Seconds of emulation per second.")] = 1.0,
    faults: Annotated[
        str | None,
        typer.Option(
            "--faults",
            metavar="SPEC",
            help="What goes wrong with every line, and with the first robot: drop:0.05,wheel:left@5+3, or FILE.toml.",
        ),
    ] = None,
    poses_to: Annotated[
        str | None,
        typer.Option(
            "--poses-to",
            metavar="udpout://HOST:PORT",
            help="Send there what a camera above the table would tell; the robots then have no fix of their own.",
        ),
    ] = None,
    public: Annotated[bool, typer.Option("--public", help="Allow addresses that other machines can reach.")] = False,
    live: LiveOption = False,
    open_page: live_options.OpenOption = None,
    seed: common.SeedOption = 1,
    as_json: common.JsonLinesOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,  # noqa: ARG001 - handled while parsing
) -> None:
    """Serve emulated micro-robots on one table until interrupted, each with its firmware, at the pace of real time.

    Robots are numbered network by network, RANGERs first. The address of each network is printed, a line each:
    in the example with the ports 5760, 5761 and 5762.

    Example: hil emulate swarm --networks 3 --link tcp://127.0.0.1:5760
    """
    from simdevice.serving.networks import NetworksServer  # noqa: PLC0415 - pymunk takes a moment to load
    from simdevice.swarm.disturbed import DisturbedSwarm  # noqa: PLC0415

    console = common.consoles(as_json=as_json, quiet=quiet)
    page = live_options.live_page(live, open_page, public=public and live, no_log=False)
    spec = None if faults is None else _faults(faults)
    if period not in set(Period):
        raise common.UsageError(f"--period is 5 or 10 (ms), not {period}")
    if count is not None and (rangers is not None or wilds is not None):
        raise common.UsageError("--count and --rangers or --wilds exclude each other")
    who = (count, 0) if count is not None else (_RANGERS if rangers is None else rangers, _WILDS if wilds is None else wilds)
    target = None if poses_to is None else _target(poses_to, public=public)
    with ExitStack() as opened, interrupts():
        endpoints = _open(_links(link or [_default_link()], networks), opened, public=public)
        if len({endpoint.wire for endpoint in endpoints}) > 1:
            raise common.UsageError("the networks of one table are all CAN buses, or none is")

        def settings() -> SwarmSettings:
            from simdevice.swarm.settings import SwarmSettings  # noqa: PLC0415 - as above

            profile = read_profile(noise)
            return SwarmSettings(
                *who,
                wall=wall,
                seed=seed,
                networks=networks,
                wire=endpoints[0].wire,
                profile=profile if dropout is None else replace(profile, dropout=dropout),
                occlusion=occlusion,
                ring=ring,
                fixes=target is None,
                period=period / 1000,
                size=None if size is None else size_of(size),
                rooms=rooms_of(room or []),
                faults=spec,
            )

        world = _world(settings)
        poses = None if target is None else opened.enter_context(closing(_Poses(world, target)))
        urls = [endpoint.url for endpoint in endpoints]
        if as_json:
            common.print_json_line(
                {
                    "robot": "swarm",
                    "urls": urls,
                    "count": world.settings.count,
                    "rangers": who[0],
                    "wilds": who[1],
                    "per_network": world.settings.per,
                    "seed": seed,
                    "pid": os.getpid(),
                }
                | ({"faults": str(spec)} if spec is not None else {})
            )
        else:
            for url in urls:
                console.print(url, markup=False)
            if not quiet:
                console.print(f"{who[0]} RANGERs and {who[1]} WILDs are there.", markup=False)
                console.print(f"For instance: hil ports {' '.join(map(shlex.quote, urls))}", markup=False)
        common.flush()
        served = world if spec is None else DisturbedSwarm(world, spec, seed)
        lived = poses.send if poses is not None else lambda: None
        shown_at, stopped = opened.enter_context(shown(page, HandledSwarm(world), endpoints, console))
        server = NetworksServer(served, shown_at, MonotonicClock(), speed=speed, lived=lived)
        try:
            server.run(stopped)
        finally:
            if server.overruns and as_json:
                common.print_json_line({"overruns": server.overruns, "late": server.late})
            elif server.overruns and not quiet:
                console.print(f"This machine was too slow {server.overruns} times: {server.late} control periods were late.")


def _world(settings: Callable[[], SwarmSettings]) -> SwarmWorld:
    """The world that was asked for."""
    from simdevice.swarm.world import SwarmWorld  # noqa: PLC0415 - as above

    try:
        return SwarmWorld(settings())
    except (ValueError, ProfileFileError) as error:
        raise common.UsageError(str(error)) from error


class _Poses:
    """Sends what a camera would tell.

    Args:
        world: The robots.
        target: Where to.
    """

    def __init__(self, world: SwarmWorld, target: tuple[str, int]) -> None:
        from simdevice.swarm.poses import PoseLines  # noqa: PLC0415 - as above

        family = socket.getaddrinfo(*target, type=socket.SOCK_DGRAM)[0][0]
        self._lines = PoseLines(world)
        self._target = target
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.settimeout(0.0)

    def send(self) -> None:
        """Send what is new; what nobody takes is lost."""
        for datagram in self._lines.news():
            try:
                self._socket.sendto(datagram, self._target)
            except OSError:
                return

    def close(self) -> None:
        """Give the socket back."""
        self._socket.close()


def _default_link() -> str:
    return f"pty:{BAUD}" if hasattr(os, "openpty") else "tcp://127.0.0.1:5760"


def _links(links: list[str], networks: int) -> list[str]:
    """Where each network is served."""
    if len(links) == networks:
        return [f"pty:{BAUD}" if link == "pty" else link for link in links]
    if len(links) != 1:
        raise common.UsageError(f"--link is given once, or once for each of the {networks} networks, not {len(links)} times")
    link = links[0]
    if link.partition(":")[0] in {"pty", "slcan"} and "://" not in link:
        return [f"pty:{BAUD}" if link == "pty" else link] * networks
    address = parse_address(link)
    if address.scheme not in {"tcp", "udp", "udpin"}:
        raise common.UsageError(f"{link} has no port that could be counted up: give --link once for each network")
    host, colon, _ = link.rpartition(":")
    first = address.host_port()[1]
    if first + networks - 1 > 65535:
        raise common.UsageError(f"there are not {networks} ports from {first} on")
    return [f"{host}{colon}{first + number if first else 0}" for number in range(networks)]


def _open(links: list[str], opened: ExitStack, *, public: bool) -> list[Endpoint]:
    """Open where the networks are served."""
    from simdevice.serving.opening import open_endpoint  # noqa: PLC0415 - python-can takes its time

    return [opened.enter_context(closing(open_endpoint(link, public=public))) for link in links]


def _target(text: str, *, public: bool) -> tuple[str, int]:
    """Where poses go."""
    address = parse_address(text)
    if address.scheme != "udpout":
        raise AddressError(text, "poses are sent by UDP", "Write it as udpout://127.0.0.1:14600")
    address.only()
    host, port = address.host_port()
    if not public and host not in {"127.0.0.1", "localhost", "::1"}:
        raise AddressError(text, "poses would leave this machine", "Use 127.0.0.1, or allow it with --public")
    return host, port


def _faults(text: str) -> FaultSpec:
    try:
        return read_faults(text)
    except FaultSpecError as error:
        raise common.UsageError(f"--faults: {error}") from error
