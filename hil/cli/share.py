"""`--share`: other programs look on at the robots of a run."""

from __future__ import annotations

from ipaddress import ip_address
from typing import TYPE_CHECKING, Annotated, Final

import typer

from firmware_protocol.address import parse_address, whole_number
from hil.cli import common
from hil.recording.process import LinkSharing, RecorderProcess

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hil.bridge.operator import Operator
    from hil.recording.recorder import Recorder

ShareOption = Annotated[
    str | None,
    typer.Option(
        "--share",
        metavar="tcp://127.0.0.1:PORT",
        help="Let other programs look on there, over MAVLink, as hil monitor or a ground station: they can stop all robots, "
        "and do nothing else. PORT alone is one of this machine's own; 0 takes any.",
    ),
]
LOOPBACK: Final = "127.0.0.1"


class SharedAddress:
    """The link of a run, shared with programs that look on.

    Args:
        host: Address of this machine at which they come.
        port: Port; 0: any that is free.
        driver: Name of the verb that drives.
    """

    def __init__(self, host: str, port: int, driver: str) -> None:
        self.host = host
        self.port = port
        self._driver = driver

    def served(self, operator: Operator) -> LinkSharing:
        """How the process that writes the log shares it.

        Args:
            operator: Asks for what guests ask for.
        """
        return LinkSharing(operator.ask, self.host, self.port, self._driver)

    def announce(self, recorder: Recorder, say: Callable[[str], None]) -> None:
        """Say where it is.

        Args:
            recorder: Writes the log.
            say: Says so.
        """
        if not isinstance(recorder, RecorderProcess):
            common.complain("the link can't be shared: this Python can't be started once more")
            return
        say(f"Shared: {recorder.shared}")
        if not _own(self.host):
            say("Other machines get there, too: whoever does may look on, and stop all robots.")


def shared_address(
    share: str | None, links: Sequence[str] | None, driver: str, *, no_log: bool, paced: bool = False
) -> SharedAddress | None:
    """What the option asks for; None: the link is not shared.

    Args:
        share: `--share`.
        links: Addresses of the robots; None: they are emulated in this process.
        driver: Name of the verb.
        no_log: `--no-log`.
        paced: An emulated robot in this process runs no faster than time.

    Raises:
        AddressError: It is no address.
        UsageError: It can't be shared, or not there.
    """
    if share is None:
        return None
    number = whole_number(share, 65535)
    address = parse_address(share if number is None else f"tcp://{LOOPBACK}:{number}")
    if address.scheme != "tcp":
        raise common.UsageError(f"--share is by TCP: write it as tcp://{LOOPBACK}:5760, not {share}")
    address.only()
    if no_log:
        raise common.UsageError("--share shares what is recorded: leave out --no-log")
    if links is not None and len(links) > 1:
        raise common.UsageError("--share shares one link: on several, robots have the same ids")
    if not paced and (links is None or parse_address(links[0]).scheme == "sim"):
        raise common.UsageError(
            "--share shares a robot's link, and an emulated robot of this process runs faster than anybody looks on: "
            "serve one by hil emulate, and name its address here; --live shows this run in a browser"
        )
    return SharedAddress(*address.host_port(), driver)


def _own(host: str) -> bool:
    """Whether this machine's own programs alone get to an address."""
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
