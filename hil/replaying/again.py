"""Whether a recorded run can be done again: of an emulated robot in the same process, with nothing that a log may not name."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.address import parse_address
from hil.jobs.team import TeamJob

if TYPE_CHECKING:
    from hil.replaying.tape import Tape


def why_not_again(tape: Tape, url: str) -> str:
    """Why a recorded run can't be done again (`hil replay --rerecord`), in words; empty where it can.

    Args:
        tape: Its log.
        url: Address of its robot; empty where it has none.

    Raises:
        AddressError: That is none.
    """
    if tape.config.get("verb") == TeamJob.VERB:
        return f"{tape.path} is of several runs that others have made: each has a log of its own, which can be recorded again"
    if not url:
        return f"{tape.path} is of a search, whose runs others have played: each of them can be done again by its case and seed"
    address = parse_address(url)
    if address.scheme != "sim":
        return f"{tape.path} is of a robot at {url}: only an emulated robot in the same process does the same again"
    if tape.config.get("signed") == "true":
        return f"{tape.path} is of a run whose frames were signed: it can be replayed, and not recorded again"
    faults = address.options.get("faults", "")
    if faults.startswith("@") or faults.endswith((".toml", ".json")):
        return f"{tape.path} names a file of faults: what a log names is not opened"
    return ""
