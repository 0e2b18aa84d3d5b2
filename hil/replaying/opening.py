"""`replay:///path/log.mcap` in place of a robot's address: a program of one's own is given what it was given then."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.address import parse_address
from firmware_protocol.errors import AddressError, HilError
from firmware_protocol.faults.spec import FaultSpec
from hil.mcaplog.errors import LogError
from hil.mcaplog.limits import ReadLimits
from hil.replaying.comparison import Comparison
from hil.replaying.network import ReplayOpener
from hil.replaying.tape import ReplayEndedError, ReplayError, Tape

if TYPE_CHECKING:
    from firmware_protocol.address import Address

SCHEME = "replay"


class RecordedNetworks:
    """The networks of a log, to be connected to.

    When the program asks otherwise than was recorded, it gets a ReplayDiverged that names the step; at the end of the log, a
    ReplayEndedError.

    Args:
        address: `replay://` and the path of the log.

    Attributes:
        addresses: Of the networks, as they were opened then.

    Raises:
        AddressError: The log can't be read, or can't be replayed.
    """

    def __init__(self, address: Address) -> None:
        address.only()
        try:
            self._tape = Tape(Path(address.target), ReadLimits(), compared=False)
            self._tape.first_step()
            self.addresses = [parse_address(name) for name in self._tape.networks]
            faults = self._tape.config.get("faults")
            self._faults = None if faults is None else FaultSpec.parse(faults)
        except (LogError, ReplayError, ReplayEndedError) as error:
            raise AddressError(address.url, str(error)) from error
        except HilError as error:
            raise AddressError(address.url, f"the log does not say properly what was opened: {error}") from error

    def opener_of(self, address: Address) -> ReplayOpener:
        """What opens one of the networks.

        Args:
            address: One of `addresses`.
        """
        wire = self._tape.opening(address.url).wire
        return ReplayOpener(self._tape, address.url, self._faults, Comparison(self._tape, wire, strict=False).unlike)
