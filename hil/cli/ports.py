"""`hil ports`: what is connected, and what answers as a robot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from firmware_protocol.address import DEFAULT_BAUD, parse_address
from firmware_protocol.errors import HilError
from firmware_protocol.links.serial import list_ports
from hil.bridge import Bridge
from hil.cli import common
from hil.connecting import open_address

if TYPE_CHECKING:
    from firmware_protocol.links.serial import SerialPort


def ports(
    *,
    probe: Annotated[bool, typer.Option("--probe/--no-probe", help="Open each port and listen for a robot.")] = True,
    baud: Annotated[int, typer.Option("--baud", min=1, help="Baud rate to listen at.")] = DEFAULT_BAUD,
    timeout: Annotated[float, typer.Option("--timeout", min=0.1, max=60, help="How long to listen at each, in s.")] = 2.5,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,  # noqa: ARG001 - handled while parsing
) -> None:
    """List serial ports, and say which answer as a robot. Nothing is moved: the program only listens and asks for the version.

    Example: hil ports
    """
    console = common.consoles(as_json=as_json, quiet=quiet)
    found = list_ports()
    rows = [(port, _probe(f"serial://{port.device}:{baud}", timeout) if probe else "") for port in found]
    if as_json:
        common.print_json([_plain(port, answer, baud) for port, answer in rows])
        return
    if not rows:
        console.print(
            "There is no serial port. Plug the robot in; or try an emulated one: hil emulate junior --link pty", markup=False
        )
        return
    table = Table(box=None)
    for head in ("port", "hardware", "serial number", "who is there"):
        table.add_column(head)
    for port, answer in rows:
        table.add_row(port.device, port.description, port.serial_number, answer)
    console.print(table)


def _probe(url: str, timeout: float) -> str:
    """Who answers at a port, in words; opens no session, so that nothing is stopped or disarmed."""
    try:
        link, clock, session = open_address(parse_address(url))
    except HilError as error:
        return str(error).removeprefix(f"{url}: ")
    with Bridge(link, clock, open_sessions=False, session=session) as bridge:
        deadline = clock.now() + timeout
        try:
            while clock.now() < deadline:
                bridge.step(min(0.05, deadline - clock.now()))
                for peer in bridge.peers.values():
                    if peer.ready:
                        return f"Junior, system {peer.system}: hil coach {url}"
                    if peer.failure is not None:
                        return str(peer.failure)
        except HilError as error:
            return str(error).removeprefix(f"{url}: ")
        if bridge.peers:
            return "speaks MAVLink, but did not answer as a Junior"
        return "something is there, but no MAVLink: another baud rate?" if sum(bridge.rejected.values()) else "nothing answers"


def _plain(port: SerialPort, answer: str, baud: int) -> dict[str, object]:
    return {
        "device": port.device,
        "url": f"serial://{port.device}:{baud}",
        "description": port.description,
        "serial_number": port.serial_number,
        "answer": answer,
    }
