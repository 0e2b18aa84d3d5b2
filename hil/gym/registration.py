"""The name that Gymnasium knows the environments by."""

from __future__ import annotations

from typing import Final

import gymnasium

ENVIRONMENT: Final = "junior_hil/Sumo-v0"
"""Another number says that the same actions lead somewhere else."""


def register() -> None:
    """Make the name known, once."""
    if ENVIRONMENT not in gymnasium.registry:
        gymnasium.register(
            ENVIRONMENT, entry_point="hil.gym.environment:JuniorEnv", vector_entry_point="hil.gym.vector:JuniorVectorEnv"
        )
