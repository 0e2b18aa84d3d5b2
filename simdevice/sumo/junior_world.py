"""Makes an emulated Junior on the sumo ring, in the kernel where that can be."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.wire.fields import MAVLINK
from simdevice.kernel.world import KernelWorld
from simdevice.sumo.world import World

if TYPE_CHECKING:
    from firmware_protocol.faults.spec import FaultSpec
    from firmware_protocol.wire.signing import SigningKey
    from simdevice.board_interface import BoardMaker
    from simdevice.boards import Host
    from simdevice.junior.profile import JuniorProfile


def junior_world(
    *,
    opponent: str = "flat-light",
    seed: int = 1,
    referee: bool = True,
    profile: JuniorProfile | None = None,
    nvm: bytes | None = None,
    host: Host | None = None,
    wire: str = MAVLINK,
    faults: FaultSpec | None = None,
    board: BoardMaker | None = None,
    signing_key: SigningKey | None = None,
    start_held: bool = False,
) -> World:
    """An emulated Junior on the sumo ring.

    Args:
        opponent: `flat-light`, `flat-heavy`, `curved-light`, `corner-light`, `point-light` or `junior`.
        seed: Seed of everything random.
        referee: There is a referee on the wire.
        profile: The device's numbers; None are the defaults.
        nvm: Image of Junior's EEPROM; None is a new robot.
        host: Build of the firmware that Junior runs; None is the one that comes with the package.
        wire: `mavlink`, or `can` for CAN frames in serial form.
        faults: What goes wrong with Junior, by the world's time; None is nothing.
        board: Makes Junior's board, as `AvrBoard` does; None is one in this process.
        signing_key: Key that Junior and the referee sign with; None: Junior has the one in `nvm`, if any.
        start_held: Junior is switched on with its start input held: it forgets the time of its signatures that is in `nvm`.

    Returns:
        A world at time 0, with everybody at a start pose. Its control periods run in the kernel, or with another board or
        another build of the firmware in Python; both say the same at the same time.

    Raises:
        ValueError: There is no opponent of this name, or the image has a wrong size.
    """
    return (World if board is not None or host is not None else KernelWorld)(
        opponent=opponent,
        seed=seed,
        referee=referee,
        profile=profile,
        nvm=nvm,
        host=host,
        wire=wire,
        faults=faults,
        board=board,
        signing_key=signing_key,
        start_held=start_held,
    )
