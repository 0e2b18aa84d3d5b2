"""`hil monitor`: a live view of one robot."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from firmware_protocol.address import parse_address
from firmware_protocol.errors import PeerError, PeerLostError, RefusedError
from firmware_protocol.messages import SensorFlag, State
from firmware_protocol.vocabulary import Stimulus
from hil.cli import common
from hil.cli.overview import Overview
from hil.cli.running import running
from hil.cli.session import Session, open_session, open_watch
from hil.connecting import asked_for
from hil.junior import STIMULUS_BITS
from hil.keys import pressed_keys
from hil.suspending import around_stop

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from rich.console import Console

    from firmware_protocol.messages import JuniorSensors
    from hil.cli.running import ActiveRun
    from hil.junior import Junior
    from hil.robots import Robots

DRIVE_TIME = 0.3
"""A key drives for this long, in s; holding it down repeats it."""
SPEED, TURN = 0.6, 0.35
DRIVES = {"^": (SPEED, SPEED), "v": (-SPEED, -SPEED), "<": (-TURN, TURN), ">": (TURN, -TURN)}
STOPS = "Ee "
"""The keys that stop, the hardest first: all robots, this robot, and its wheels alone."""
QUIT = "q\x03\x04"
HELP = "a arm   d disarm   arrows drive   space stop   e emergency stop   q quit"
LOCKSTEP_DURATION = 10.0
"""How much is shown of what runs faster than time, in s."""
IN_LOCKSTEP = "An emulated robot in this process runs faster than time: shown are its first 10 s."
LINE_EVERY = 1.0
"""Without a terminal a line is printed this often, in s."""


def monitor(
    link: common.LinkArgument = None,
    *,
    duration: Annotated[
        float | None,
        typer.Option(
            "--duration",
            min=0.1,
            help="Stop after this time, in s; left out, a robot emulated in this process is shown for 10 s, "
            "any other until Ctrl-C.",
        ),
    ] = None,
    signing_key: common.SigningKeyOption = None,
    reconnect: common.ReconnectOption = common.RECONNECT,
    seed: common.SeedOption = 1,
    out: common.OutOption = None,
    log: common.LogOption = None,
    no_log: common.NoLogOption = False,
    overwrite: common.OverwriteOption = False,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,  # noqa: ARG001 - handled while parsing
) -> int:
    """Show what a robot senses and how good the link is; drive it by keys. It is disarmed until you arm it.

    Pull the plug and put it back: it goes on, and the robot is disarmed.

    Of several robots on one link each has a line. They are only watched; the keys n and p choose one, and the first key that
    moves it stops and disarms it first.

    Example: hil monitor serial:///dev/ttyACM0:115200
    """
    console = common.consoles(as_json=as_json, quiet=quiet)
    url = common.url_of(link, None, seed)
    with running(
        "monitor",
        "emulated" if link is None else "robot",
        url=url,
        emulated_here=link is None,
        seed=seed,
        signing_key=signing_key,
        out=out,
        log=log,
        no_log=no_log,
        overwrite=overwrite,
    ) as run:
        connection = _Connection(url, run, {"verb": "monitor", "seed": seed}, reconnect, signing_key)
        document = _show(connection, console, duration, as_json=as_json, quiet=quiet)
        run.finish({})
    if as_json:
        with run.telling():
            common.print_json(document)
    return run.ended()


@dataclass(frozen=True)
class _Connection:
    """How the robots are reached.

    Attributes:
        url: Address.
        run: The run that this is.
        config: What it was asked to do, for the log.
        reconnect: How long a robot or link that is lost is waited for, in s.
        signing_key: Key file.
    """

    url: str
    run: ActiveRun
    config: Mapping[str, object]
    reconnect: float
    signing_key: Path | None


def _show(
    connection: _Connection, console: Console, duration: float | None, *, as_json: bool, quiet: bool
) -> dict[str, object] | list[dict[str, object]]:
    """Show one robot, or several; what `--json` prints of them in the end."""
    live, silent = console.is_terminal and not as_json and not quiet, as_json or quiet
    url, run, config = connection.url, connection.run, connection.config
    reconnect, key = connection.reconnect, connection.signing_key
    told = common.teller(console, quiet=quiet)
    if _may_be_several(url):
        with open_watch(url, run=run, config=config, reconnect=reconnect, tell=told, signing_key=key) as (robots, recorder):
            members = list(robots)
            if len(members) > 1:
                overview = Overview(robots, lambda junior, key: _obey(Session(junior, recorder), key))
                _look(overview, robots, console, duration, live=live, silent=silent)
                return [_plain(junior) for junior in overview.members if junior.latest is not None]
            members[0].take()
            _watch(Session(members[0], recorder), console, duration, live=live, silent=silent)
            return _plain(members[0])
    with open_session(url, run=run, config=config, arm=False, reconnect=reconnect, tell=told, signing_key=key) as session:
        if session.lockstep and duration is None:
            duration = LOCKSTEP_DURATION
            console.print(IN_LOCKSTEP)
        _watch(session, console, duration, live=live, silent=silent)
        return _plain(session.junior)


def _may_be_several(link: str) -> bool:
    """The address leaves open which robot is meant, and it is not one alone in this process."""
    address = parse_address(link)
    return asked_for(address) is None and (address.scheme != "sim" or "count" in address.options)


def _look(overview: Overview, robots: Robots, console: Console, duration: float | None, *, live: bool, silent: bool) -> None:
    """Show several robots."""
    if duration is None and all(bridge.link.lockstep for bridge in robots.networks.bridges.values()):
        duration = LOCKSTEP_DURATION
        console.print(IN_LOCKSTEP)
    end = None if duration is None else robots.now() + duration
    line_due = robots.now()
    with pressed_keys() as keys, _display(console) as display:
        while end is None or robots.now() < end:
            robots.step()
            for key in worth_obeying(keys()):
                if key in QUIT:
                    return
                overview.press(key)
            if live:
                display.update(overview.view(), refresh=True)
            elif not silent and robots.now() >= line_due:
                line_due = robots.now() + LINE_EVERY
                console.print(f"{robots.now():.2f} s", *overview.lines(), sep="\n", markup=False)


@contextmanager
def _display(console: Console) -> Iterator[Live]:
    """What is drawn again and again; while the program is stopped, the cursor is given back."""
    with Live(console=console, auto_refresh=False, transient=False) as display, around_stop(display.stop, display.start):
        yield display


def _watch(session: Session, console: Console, duration: float | None, *, live: bool, silent: bool) -> None:
    junior = session.junior
    end = None if duration is None else junior.now() + duration
    line_due = junior.now()
    refusal = ""
    with pressed_keys() as keys, _display(console) as display:
        while end is None or junior.now() < end:
            junior.step()
            for key in worth_obeying(keys()):
                if key in QUIT:
                    return
                refusal = _obey(session, key)
            try:
                if live:
                    display.update(_view(junior, refusal), refresh=True)
                elif not silent and junior.now() >= line_due:
                    line_due = junior.now() + LINE_EVERY
                    console.print(_line(junior), markup=False)
            except PeerLostError:  # it was lost before its first reading came
                continue


def worth_obeying(keys: str) -> str:
    """Of the keys pressed since the last look, those that still matter.

    A key held down repeats faster than a bad line answers: it counts once, or the robot would go on after it was let go.
    What was pressed before a stop is not done at all; of several stops the hardest counts, wherever it was pressed, so that a
    space bar behind it does not make a mere stop of an emergency stop. To leave is never forgotten.

    Args:
        keys: What was pressed, in order.
    """
    stops = [key for key in keys if key in STOPS]
    if not stops:
        return "".join(key for key, _ in groupby(keys))
    last_stop = max(keys.rfind(key) for key in STOPS)
    after = "".join(key for key, _ in groupby(keys[last_stop + 1 :]))
    left = "".join(key for key in keys[:last_stop] if key in QUIT)[:1]
    return min(stops, key=STOPS.index) + (left or after)


def _obey(session: Session, key: str) -> str:
    """Do what a key asks, and put it into the log.

    Returns:
        Why the robot refused; empty when it did not.
    """
    junior = session.junior
    if session.recorder is not None:
        session.recorder.operator(key)
    try:
        match key:
            case "a":
                junior.arm()
            case "d":
                junior.disarm()
            case "e" | "E":
                junior.emergency_stop()
            case " ":
                junior.stop()
            case _ if key in DRIVES:
                junior.drive(*DRIVES[key], DRIVE_TIME)
            case _:
                pass
    except RefusedError as error:
        if session.recorder is not None:
            session.recorder.note("safety", str(error))
        return str(error)
    except PeerError as error:  # it may be back, and the next key may reach it
        return str(error)
    return ""


def _names(sensors: JuniorSensors) -> str:
    return ", ".join(str(flag.name).lower().replace("_", " ") for flag in SensorFlag(sensors.flags & 0xFF)) or "nothing"


def _shown(junior: Junior) -> JuniorSensors:
    """The latest reading, however old: `_warning` says so. The first is waited for."""
    return junior.latest or junior.sensors


def _line(junior: Junior) -> str:
    sensors, counters = _shown(junior), junior.peer.counters
    state = junior.state.name.lower() if junior.peer.ready else "not heard" if junior.bridge.lost is None else "no link"
    return (
        f"{sensors.time:8.2f} s  {state:10}  eyes {sensors.eye[0]:4} {sensors.eye[1]:4}  "
        f"floor {sensors.floor[0]:4} {sensors.floor[1]:4}  battery {sensors.battery:.2f} V  senses {_names(sensors)}  "
        f"frames {counters.good}, lost {counters.lost}, rejected {counters.rejected}"
        f"{'  ' if (warning := _warning(junior)) else ''}{warning}"
    )


def _view(junior: Junior, refusal: str) -> Group:
    sensors, counters = _shown(junior), junior.peer.counters
    table = Table(title=junior.description, title_justify="left", show_header=True, box=None)
    for head in ("", "left", "right"):
        table.add_column(head, justify="right" if head else "left")
    table.add_row("eye (counts)", str(sensors.eye[0]), str(sensors.eye[1]))
    table.add_row("floor (counts)", str(sensors.floor[0]), str(sensors.floor[1]))
    table.add_row("travel (mm)", f"{sensors.travel[0] * 1000:.0f}", f"{sensors.travel[1] * 1000:.0f}")
    latency = f"{counters.latency * 1000:.1f} ms" if counters.answers else "-"
    return Group(
        table,
        f"senses: {_names(sensors)}",
        f"state: {junior.state.name.lower()}{' (armed)' if junior.armed else ''}   battery {sensors.battery:.2f} V"
        f"{'   EMERGENCY STOP: d, then a' if junior.state is State.STOPPED else ''}",
        f"link: {counters.good} frames, {counters.lost} lost, {counters.rejected} rejected, "
        f"{counters.retries} repeated, answer in {latency}",
        _warning(junior),
        Text(refusal),
        HELP,
    )


def _warning(junior: Junior) -> str:
    """What makes the readings old; empty when they are not."""
    if not junior.stale:
        return ""
    old = f"these readings are {junior.age:.1f} s old"
    if junior.peer.ready:
        return f"NO READINGS COME, stopped by another client: {old}"
    if junior.bridge.lost is not None:
        return f"LINK LOST, trying to open it again: {old}"
    return f"NOT HEARD ANY MORE: {old}"


def _plain(junior: Junior) -> dict[str, object]:
    sensors, counters = _shown(junior), junior.peer.counters
    return {
        "system": junior.peer.system,
        "state": junior.state.name.lower(),
        "armed": junior.armed,
        "time": sensors.time,
        "age_s": junior.age,
        "stale": junior.stale,
        "eye": list(sensors.eye),
        "floor": list(sensors.floor),
        "travel": list(sensors.travel),
        "battery": sensors.battery,
        "stimulus": Stimulus(sensors.flags & STIMULUS_BITS).label,
        "link": {
            "good": counters.good,
            "lost": counters.lost,
            "rejected": counters.rejected,
            "retries": counters.retries,
            "latency_s": counters.latency if counters.answers else None,
        },
    }
