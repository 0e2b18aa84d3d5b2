"""`hil emulate junior`: serves an emulated robot in real time."""

from __future__ import annotations

import os
import shlex
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from firmware_protocol.errors import FaultSpecError, LinkOpenError
from firmware_protocol.faults.spec import FaultSpec
from firmware_protocol.wire.fields import MAVLINK
from firmware_protocol.wire.signing import Signing
from hil.bridge.clock import MonotonicClock
from hil.cli import common
from hil.cli import live as live_options
from hil.cli.emulate_live import LiveOption, juniors, shown
from hil.connecting.connecting import with_system
from hil.connecting.junior_address import board_maker
from hil.files.fault_file import read_faults
from hil.files.memory_file import load_memory
from hil.files.outputs import replace_file
from hil.signing.key_file import calendar, load_key, no_signatures
from hil.terminal.interrupts import interrupts

if TYPE_CHECKING:
    from firmware_protocol.wire.signing import SigningKey
    from simdevice.serving.endpoints import Endpoint
    from simdevice.sumo.world import World

CROWD_BAUD = 921600
"""Rate of a pty that several robots share, unless another is asked for, in bit/s: each says up to 3 kB a second."""


class BoardName(StrEnum):
    """What the robot's firmware runs on."""

    HOST = "host"
    AVR = "avr"


def emulate(
    *,
    link: Annotated[
        str, typer.Option("--link", help="pty, pty:57600, tcp://127.0.0.1:5760, udp://127.0.0.1:14550, slcan or can://....")
    ] = "pty" if hasattr(os, "openpty") else "tcp://127.0.0.1:5760",
    count: Annotated[
        int, typer.Option("--count", min=1, max=254, help="So many robots on the one link, with system or node ids from 1.")
    ] = 1,
    opponent: Annotated[
        str, typer.Option("--opponent", autocompletion=common.opponents, help=f"One of {', '.join(common.OPPONENTS)}.")
    ] = "flat-light",
    board: Annotated[
        BoardName, typer.Option("--board", help="host: the firmware in this process; avr: its ELF on an emulated ATmega328P.")
    ] = BoardName.HOST,
    speed: Annotated[float, typer.Option("--speed", min=0.01, max=100, help="Seconds of emulation per second.")] = 1.0,
    referee: Annotated[
        bool, typer.Option("--referee/--no-referee", help="A referee sees the ring; without, it is as with a physical robot.")
    ] = True,
    faults: Annotated[
        str | None,
        typer.Option(
            "--faults",
            metavar="SPEC",
            help="What goes wrong with the line and the robot: drop:0.05,stuck:eye_left@5+3,brownout:20+1, or FILE.toml.",
        ),
    ] = None,
    memory: Annotated[
        Path | None, typer.Option("--memory", metavar="FILE", help="Keep the robot's EEPROM in this file between runs.")
    ] = None,
    public: Annotated[bool, typer.Option("--public", help="Allow addresses that other machines can reach.")] = False,
    live: LiveOption = False,
    open_page: live_options.OpenOption = None,
    signing_key: Annotated[
        Path | None, typer.Option("--signing-key", metavar="FILE", help="The robot comes up with this key, and signs.")
    ] = None,
    forget_time: Annotated[
        bool,
        typer.Option(
            "--forget-time",
            help="Switch on the robot of --memory with its start input held: it forgets how far its signatures' time has come, "
            "and keeps its key.",
        ),
    ] = False,
    seed: common.SeedOption = 1,
    as_json: common.JsonLinesOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,  # noqa: ARG001 - handled while parsing
) -> None:
    """Serve an emulated robot until interrupted: to any program that speaks MAVLink, or CAN, at the pace of real time.

    Over CAN the same robot speaks CAN frames: on a bus that python-can knows (can://udp_multicast/239.74.163.2), or behind
    a serial CAN adapter on a pty (slcan). Of a pty the port is printed:
    hil monitor PORT shows the robot. With --count several robots share the link, each in a ring of its own.

    Example: hil emulate junior --link pty --opponent flat-heavy
    """
    from simdevice.disturbed import DisturbedWorld  # noqa: PLC0415
    from simdevice.serving.server import Server  # noqa: PLC0415
    from simdevice.sumo.crowd import Crowd  # noqa: PLC0415 - pymunk takes a moment to load
    from simdevice.sumo.junior_world import junior_world  # noqa: PLC0415
    from simdevice.sumo.settings import WorldSettings  # noqa: PLC0415

    common.check_opponent(opponent)
    console = common.consoles(as_json=as_json, quiet=quiet)
    page = live_options.live_page(live, open_page, public=public and live, no_log=False)
    nvm = _load(memory, board, count, forget_time=forget_time)
    spec = FaultSpec() if faults is None else _read(faults)
    key = _load_key(signing_key, board)
    endpoint = _open(f"pty:{CROWD_BAUD}" if link == "pty" and count > 1 else link, key, public=public)
    wire = endpoint.wire
    world: World | Crowd
    try:
        settings = WorldSettings(
            opponent=opponent,
            seed=seed,
            referee=referee,
            nvm=nvm,
            wire=wire,
            faults=spec,
            board=board_maker(board, wire),
            signing_key=key,
            start_held=forget_time,
        )
        world = junior_world(settings) if count == 1 else Crowd(count, settings)
    except LinkOpenError:
        endpoint.close()
        raise
    except ValueError as error:
        endpoint.close()
        raise common.UsageError(str(error)) from error
    served = world if faults is None else DisturbedWorld(world, spec, seed)
    with interrupts(), shown(page, juniors(world), [endpoint], console) as (endpoints, stopped):
        server = Server(served, endpoints[0], MonotonicClock(), speed=speed)
        if as_json:
            document = {"robot": "junior", "url": endpoint.url, "count": count, "opponent": opponent, "pid": os.getpid()}
            common.print_json_line(document | ({"faults": str(spec), "seed": seed} if faults is not None else {}))
        else:
            who = "Junior is" if count == 1 else f"{count} Juniors, system ids 1 to {count}, are"
            console.print(f"{who} at {endpoint.url}", markup=False)
            if faults is not None:
                console.print(f"Faults: {spec} (seed {seed})", markup=False)
            if not quiet:
                console.print(_suggestion(endpoint.url, count, signing_key), markup=False)
        common.flush()
        try:
            server.run(stopped)
        finally:
            endpoint.close()
            if memory is not None:
                replace_file(memory, world.nvm)
            if server.overruns and as_json:
                common.print_json_line({"overruns": server.overruns, "late": server.late})
            elif server.overruns and not quiet:
                console.print(f"This machine was too slow {server.overruns} times: {server.late} control periods were late.")


def _open(link: str, key: SigningKey | None, *, public: bool) -> Endpoint:
    """Open where the robot is served, for a robot that has this key."""
    from simdevice.serving.admission import SERVER_LINK  # noqa: PLC0415
    from simdevice.serving.opening import open_endpoint  # noqa: PLC0415

    signing = Signing(key, calendar, link=SERVER_LINK) if key is not None else None
    endpoint = open_endpoint(link, public=public, signing=signing)
    if key is not None and endpoint.wire != MAVLINK:
        endpoint.close()
        raise no_signatures(link)
    return endpoint


def _suggestion(url: str, count: int, signing_key: Path | None) -> str:
    """What to try next."""
    one = shlex.quote(url if count == 1 else with_system(url, count))
    key = f" --signing-key {shlex.quote(str(signing_key))}" if signing_key else ""
    return f"For instance: hil monitor {shlex.quote(url)}{key}    or: hil coach {one}{key}"


def _load_key(path: Path | None, board: BoardName) -> SigningKey | None:
    if path is None:
        return None
    if board is not BoardName.HOST:
        raise common.UsageError("the firmware of this board is built without signing: leave --signing-key out")
    return load_key(path)


def _read(faults: str) -> FaultSpec:
    try:
        return read_faults(faults)
    except FaultSpecError as error:
        raise common.UsageError(f"--faults: {error}") from error


def _load(memory: Path | None, board: BoardName, count: int, *, forget_time: bool) -> bytes | None:
    if forget_time and board is not BoardName.HOST:
        raise common.UsageError("the firmware of this board is built without signing: leave --forget-time out")
    if forget_time and memory is None:
        raise common.UsageError("a new robot has no time to forget: --forget-time is for the one that --memory FILE keeps")
    return None if memory is None else load_memory(memory, count)
