"""Makes an emulated Junior on the sumo ring, in the kernel where that can be."""

from __future__ import annotations

from typing import TYPE_CHECKING

from simdevice.kernel.world import KernelWorld
from simdevice.sumo.world import World

if TYPE_CHECKING:
    from simdevice.sumo.settings import WorldSettings


def junior_world(settings: WorldSettings | None = None) -> World:
    """An emulated Junior on the sumo ring.

    Args:
        settings: What it begins with; None are the defaults.

    Returns:
        A world at time 0, with everybody at a start pose. Its control periods run in the kernel, or with another board or
        another build of the firmware in Python; both say the same at the same time.

    Raises:
        ValueError: There is no opponent of this name, or the image has a wrong size.
    """
    if settings is not None and (settings.board is not None or settings.host is not None):
        return World(settings)
    return KernelWorld(settings)
