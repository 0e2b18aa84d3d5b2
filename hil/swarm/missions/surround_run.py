"""A run of the surround task on an emulated table of its own, as a function of what is asked; and what every run is made of."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.vocabulary import RobotClass
from hil.seeds import Branch, generator
from hil.swarm.cast import cast
from hil.swarm.connecting import connect_swarm
from hil.swarm.host import SwarmHost
from hil.swarm.missions.sensing import OwnRings, ReckonedRings
from hil.swarm.missions.surround import MissionError, SurroundMission
from hil.swarm.missions.surround_outcome import SurroundOutcome
from hil.swarm.placing import put_on_table
from pal_advisor.surround import PlacesError, Surround, start_places

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.swarm.cast import Cast
    from hil.swarm.missions.sensing import SightSource
    from hil.swarm.missions.surround import SurroundState
    from hil.swarm.missions.surround_settings import SurroundSettings
    from pal_advisor.surround import Case, Tables

MOST_OF_A_NETWORK: Final = 253
"""Robots that one network has ids for."""


class _States:
    """Takes down how a mission stands after every step."""

    def __init__(self) -> None:
        self.taken: list[SurroundState] = []

    def surround_state(self, state: SurroundState) -> None:
        """A step is over, or the mission begins."""
        self.taken.append(state)


def play(
    settings: SurroundSettings,
    case: Case,
    seed: int,
    *,
    tables: Tables | None = None,
    own_rings: bool = True,
    deadline: float | None = None,
) -> tuple[list[SurroundState], SurroundOutcome]:
    """Play the run of a seed on an emulated table that nobody has used before. What comes out depends on the arguments alone.

    No thread is started and no signal handled, so that any thread of any process can play.

    Args:
        settings: How it goes.
        case: The case that is played, whatever the settings name.
        seed: Of the run.
        tables: What is gone on from; None: nothing has been learnt.
        own_rings: Robots see by rings of their own; else sights are reckoned from where all are.
        deadline: Longest time of a round of moves, in s; None: as long as the robots may take.

    Returns:
        How it stood at the start and after every step, and what came of it.

    Raises:
        MissionError: There is no room for so many robots.
        PeerError: Robots do not do what they are told.
        ValueError: As of `new_adviser`.
    """
    settings = replace(settings, case=str(case))
    states = _States()
    with connect_swarm(emulated_table(settings, case, seed)) as swarm:
        chosen = cast(swarm.kinds, settings.robots, spares=False)
        swarm.needed = {kind: chosen.count(kind) for kind in RobotClass}
        swarm.sense(**settings.sensed)
        swarm.arm()
        groups = start_poses(chosen, settings, case, generator(seed, Branch.START_PLACES))
        put_on_table(swarm, by_row(groups), seed=seed, size=settings.size, wall=case.wall)
        host = SwarmHost(swarm, chosen, deadline=deadline)
        adviser, sensing = new_adviser(settings, case, seed, tables), sight_source(host, settings, own=own_rings)
        mission = SurroundMission(host, settings, case, adviser, sensing, seed=seed, observers=(states,))
        mission.begin()
        while not mission.finished:
            mission.step()
    outcome = SurroundOutcome(seed, case, mission.history, adviser.tables(str(case)), tuple(host.absences))
    return states.taken, outcome


def emulated_table(settings: SurroundSettings, case: Case, seed: int) -> str:
    """Address of the table in this process that a case asks for.

    Args:
        settings: How the run goes.
        case: The case.
        seed: Of the table.
    """
    width, height = settings.size
    networks = -(-(case.rangers + case.wilds) // MOST_OF_A_NETWORK)
    more = f"&networks={networks}" if networks > 1 else ""
    robots = f"rangers={case.rangers}&wilds={case.wilds}"
    return f"sim://swarm?{robots}&wall={int(case.wall)}&size={width:g},{height:g}&seed={seed}{more}"


def start_poses(
    chosen: Cast, settings: SurroundSettings, case: Case, rng: np.random.Generator
) -> list[tuple[NDArray[np.int64], NDArray[np.float64]]]:
    """Where the robots of a case begin.

    Args:
        chosen: Who plays.
        settings: How the run goes.
        case: The case.
        rng: Source of chance.

    Returns:
        Of each class the rows, shape (n,), and the poses, shape (n, 3): x, y in m and heading in rad.

    Raises:
        MissionError: There is no room for so many.
    """
    try:
        poses = start_places(case, rng, settings.area)
    except PlacesError as error:
        raise MissionError(str(error)) from error
    to_metres = np.array([settings.unit, settings.unit, 1.0])
    return [(chosen.players[kind], poses[kind] * to_metres) for kind in RobotClass]


def by_row(groups: list[tuple[NDArray[np.int64], NDArray[np.float64]]]) -> dict[int, NDArray[np.float64]]:
    """Poses of both classes as one.

    Args:
        groups: As `start_poses` gives them.
    """
    return {row: pose for rows, poses in groups for row, pose in zip(rows.tolist(), poses, strict=True)}


def sight_source(host: SwarmHost, settings: SurroundSettings, *, own: bool) -> SightSource:
    """Where sights come from.

    Args:
        host: Holds the rounds.
        settings: How the run goes.
        own: From the robots' own rings; else they are reckoned from where all are.
    """
    return OwnRings() if own else ReckonedRings(host, settings.ring)


def new_adviser(settings: SurroundSettings, case: Case, seed: int, tables: Tables | None = None) -> Surround:
    """An adviser at the beginning of a run.

    Args:
        settings: How the run goes.
        case: The case.
        seed: Of the run.
        tables: What is gone on from; None: nothing has been learnt.

    Raises:
        ValueError: The tables are of other sectors, or of other feasible behaviours.
    """
    adviser = Surround(*settings.groups(case), generator(seed, Branch.SURROUND))
    if tables is not None:
        adviser.take(tables)
    return adviser
