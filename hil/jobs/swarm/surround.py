"""RANGERs learn to surround WILDs: one run for each seed, one after the other."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Final

from firmware_protocol.errors import HilError
from firmware_protocol.vocabulary import RobotClass
from hil.jobs.options import DAY, MOST_SEED, none_or
from hil.jobs.session import CHECKPOINT
from hil.jobs.swarm.asking import Asking
from hil.jobs.swarm.display import SurroundDisplay
from hil.jobs.swarm.session import SwarmSession, open_swarm
from hil.jobs.words import nothing
from hil.seeds import Branch, generator
from hil.swarm.cast import cast
from hil.swarm.driving import drive_to
from hil.swarm.host import Absence, SwarmHost
from hil.swarm.missions.surround import MissionError, SurroundMission
from hil.swarm.missions.surround_checkpoint import MOST_SEEDS, StandingRun, SurroundCheckpoint, checkpoint_of
from hil.swarm.missions.surround_outcome import SurroundOutcome
from hil.swarm.missions.surround_run import by_row, new_adviser, sight_source, start_poses
from hil.swarm.missions.surround_settings import SurroundSettings
from hil.swarm.missions.tables_file import tables_of, tables_text
from hil.swarm.placing import StartPlace, put_on_table
from pal_advisor.maneuvers import state_digest
from pal_advisor.surround import Surround

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Self

    import numpy as np
    from numpy.typing import NDArray

    from hil.jobs.stage import Stage
    from hil.swarm.cast import Cast
    from hil.swarm.missions.sensing import SightSource
    from pal_advisor.fields import Fields
    from pal_advisor.surround import Tables

TABLES: Final = "tables.toml"
"""What the tables that a run begins with are called in a log, and those that it ends with where there is one seed."""
CHECKPOINT_EVERY: Final = 10.0
"""Least robot time between two checkpoints, in s."""


def tables_name(seed: int, seeds: int) -> str:
    """Name of the file that holds what was learnt.

    Args:
        seed: Seed of the run.
        seeds: How many runs there are.
    """
    return TABLES if seeds == 1 else f"tables-{seed}.toml"


@dataclass(frozen=True)
class MissionOutputs:
    """Where a mission leaves what; by default nowhere.

    Attributes:
        checkpoint: Writes the checkpoint.
        save: Writes what was learnt in the run of a seed.
        cut: Is told that the mission is cut short, and how far it had come.
        ended: Is told what came of the run of a seed.
        resumed: Is told what is gone on from.
    """

    checkpoint: Callable[[bytes], object] = nothing
    save: Callable[[int, Tables], object] = nothing
    cut: Callable[[SurroundCheckpoint], None] = nothing
    ended: Callable[[SurroundOutcome], None] = nothing
    resumed: Callable[[SurroundCheckpoint], None] = nothing


@dataclass(frozen=True)
class SurroundJob:
    """Runs of the surround task.

    Attributes:
        links: Addresses of the links, or of the emulated table.
        settings: How the runs go; of those that are gone on with, their own hold.
        seed: First seed.
        seeds: How many.
        place: How robots get to their start places; None: the table puts them there where there is one.
        ring: `robot` or `positions`: where sights come from; None: rings where all robots have one.
        spare: Robots beyond what the mission needs stand by.
        quorum: Least share of each class that must be there.
        deadline: Longest time of a round of moves, in s; None: as long as the robots may take.
        poses: Address of the link over which a camera's program tells where robots are; empty: none does.
        fence: Robots that no table is with have a fence, where there is no wall.
        confirmed: Nobody is asked before the first move on robots that no table is with.
        asks: There is somebody to be asked.
        reconnect: How long robots and links that are lost are waited for, in s.
        tables: What is gone on from, as a file of TOML; None: nothing has been learnt.
        saved: The checkpoint that is gone on from; None begins anew.
        outputs: Where it leaves what.
    """

    VERB: ClassVar[str] = "swarm surround"

    links: tuple[str, ...]
    settings: SurroundSettings
    seed: int = 1
    seeds: int = 1
    place: StartPlace | None = None
    ring: str | None = None
    spare: bool = False
    quorum: float = 0.5
    deadline: float | None = None
    poses: str = ""
    fence: bool = True
    confirmed: bool = False
    asks: bool = False
    reconnect: float = 0.0
    tables: bytes | None = None
    saved: bytes | None = None
    outputs: MissionOutputs = field(default=MissionOutputs(), compare=False)

    def options(self) -> dict[str, Any]:
        """Everything that decides, but for tables and checkpoint."""
        return {
            "links": list(self.links),
            "settings": self.settings.to_dict(),
            "seed": self.seed,
            "seeds": self.seeds,
            "place": None if self.place is None else self.place.value,
            "ring": self.ring,
            "spare": self.spare,
            "quorum": self.quorum,
            "deadline": self.deadline,
            "poses": self.poses,
            "fence": self.fence,
            "confirmed": self.confirmed,
            "asks": self.asks,
            "reconnect": self.reconnect,
        }

    def files(self) -> dict[str, bytes]:
        """The tables and the checkpoint that it begins with."""
        named = {TABLES: self.tables, CHECKPOINT: self.saved}
        return {name: data for name, data in named.items() if data is not None}

    @classmethod
    def of_log(cls, options: Fields, files: Mapping[str, bytes]) -> Self:
        """As a log has it; see `Job.of_log`."""
        links = options.texts("links")
        if not links:
            raise options.wrong("links", "expected an address")
        ring = none_or(options, "ring", lambda fields, name: fields.text(name))
        if ring not in {None, "robot", "positions"}:
            raise options.wrong("ring", "expected robot or positions")
        return cls(
            links=links,
            settings=SurroundSettings.from_fields(options.table("settings")),
            seed=options.integer("seed", 0, MOST_SEED),
            seeds=options.integer("seeds", 1, MOST_SEEDS),
            place=none_or(options, "place", lambda fields, name: fields.one_of(name, StartPlace)),
            ring=ring,
            spare=options.flag("spare"),
            quorum=options.number("quorum", 0.0, 1.0),
            deadline=none_or(options, "deadline", lambda fields, name: fields.number(name, 0.0, DAY)),
            poses=options.text("poses"),
            fence=options.flag("fence"),
            confirmed=options.flag("confirmed"),
            asks=options.flag("asks"),
            reconnect=options.number("reconnect", 0.0, DAY),
            tables=files.get(TABLES),
            saved=files.get(CHECKPOINT),
        )

    def perform(self, stage: Stage) -> list[SurroundOutcome]:
        """Play all runs.

        Args:
            stage: The outside.

        Returns:
            What came of each.

        Raises:
            CastError: Robots that are asked for are not there.
            QuorumError: Too few are there to go on.
            MissionError: A run that is gone on with does not come out as it did.
        """
        with open_swarm(stage, self.links, reconnect=self.reconnect, quorum=self.quorum, poses=self.poses) as session:
            runs = _Runs(self, session, stage)
            try:
                runs.play()
            except (HilError, KeyboardInterrupt):
                runs.save()
                runs.save_tables()
                runs.attach()
                self.outputs.cut(runs.checkpoint)
                raise
            runs.attach()
            session.finish(seeds=[outcome.seed for outcome in runs.finished])
        return runs.finished


class _Runs:
    """The runs of all seeds."""

    def __init__(self, job: SurroundJob, session: SwarmSession, stage: Stage) -> None:
        self._job = job
        self._session = session
        self._stage = stage
        self._swarm = session.swarm
        self._asking = Asking(session, stage, possible=job.asks)
        saved = None if job.saved is None else checkpoint_of(job.saved)
        self._settings = job.settings if saved is None else saved.settings
        self._seed, self._seeds = (job.seed, job.seeds) if saved is None else (saved.seed, saved.seeds)
        self._standing = None if saved is None else saved.standing
        self.finished: list[SurroundOutcome] = [] if saved is None else list(saved.finished)
        if saved is not None:
            job.outputs.resumed(saved)
        self._cast = self._chosen()
        self.case = self._settings.case_of(self._cast.count(RobotClass.RANGER), self._cast.count(RobotClass.WILD))
        self._display = SurroundDisplay(stage.console, quiet=stage.quiet)
        self._display.headline(self._swarm, self.case, self._settings)
        self._mission: SurroundMission | None = None
        self._seed_under_way = self._seed
        self._again: StandingRun | None = None
        self._before: tuple[Absence, ...] = ()
        self._state: dict[str, Any] | None = None
        self._saved_at = 0.0

    @property
    def checkpoint(self) -> SurroundCheckpoint:
        """How far it has come, in whole steps."""
        return SurroundCheckpoint(self._settings, self._seed, self._seeds, tuple(self.finished), self._stands())

    def _stands(self) -> StandingRun | None:
        """Where the run under way stands after its last whole step."""
        mission = self._mission
        if mission is None or self._state is None:
            return self._again or self._standing
        if self._again is not None and mission.step_number < self._again.history.steps:
            return self._again
        return StandingRun(self.case, mission.history, self._state, state_digest(self._state), self._absences(mission))

    def play(self) -> None:
        """Play all that are left."""
        if not self._swarm.has_table:
            self._asking.see_fence(wanted=self._job.fence and not self.case.wall)
            if not self._job.confirmed:
                self._asking.first_move()
        self._swarm.sense(**self._settings.sensed)
        self._swarm.arm()
        self._swarm.see_quorum()
        self.save()
        with self._display:
            for seed in range(self._seed + len(self.finished), self._seed + self._seeds):
                self._seed_under_way = seed
                self._play(seed)

    def save(self) -> None:
        """Write the checkpoint."""
        self._job.outputs.checkpoint(self.checkpoint.to_bytes())

    def save_tables(self) -> None:
        """Write what was learnt in the run under way."""
        if self._mission is not None:
            self._job.outputs.save(self._seed_under_way, self._tables(self._mission))

    def attach(self) -> None:
        """Put into the log how far it has come, and what was learnt: whoever has the log can go on from there."""
        self._session.attach(CHECKPOINT, self.checkpoint.to_bytes())
        learnt = [(outcome.seed, outcome.tables) for outcome in self.finished]
        if self._mission is not None:
            learnt.append((self._seed_under_way, self._tables(self._mission)))
        for seed, tables in learnt:
            self._session.attach(tables_name(seed, self._seeds), tables_text(tables).encode())

    # --- before the runs ---------------------------------------------------------------------------------------------

    def _chosen(self) -> Cast:
        """Who plays."""
        found = cast(self._swarm.kinds, self._settings.robots, spares=self._job.spare)
        self._swarm.needed = {kind: found.count(kind) for kind in RobotClass}
        return found

    def _sensing(self, host: SwarmHost) -> SightSource:
        ring = self._job.ring
        own = bool(self._swarm.rings[host.playing].all()) if ring is None else ring == "robot"
        return sight_source(host, self._settings, own=own)

    def _place(self, seed: int, *, resumed: bool) -> None:
        """Bring the robots to where the run begins."""
        place = self._job.place
        if place is None:
            place = StartPlace.AS_IS if resumed else StartPlace.TABLE if self._swarm.has_table else StartPlace.DRIVE
        if place is not StartPlace.AS_IS:
            rng = generator(seed, Branch.START_PLACES)
            groups = start_poses(self._cast, self._settings, self.case, rng)
            if place is StartPlace.DRIVE:
                self._drive(groups, rng)
                return
            poses = by_row(groups)
            if place is StartPlace.ASK:
                self._asking.places(poses)
                return
            put_on_table(self._swarm, poses, seed=seed, size=self._settings.size, wall=self.case.wall)

    def _drive(self, groups: list[tuple[NDArray[np.int64], NDArray[np.float64]]], rng: np.random.Generator) -> None:
        """Have the robots drive to their places, and say who has not come there."""
        host = SwarmHost(self._swarm, self._cast, observers=self._session.observers())
        late = drive_to(host, groups, rng)
        if late:
            named = ", ".join(self._swarm.labels[row] for row in late)
            self._stage.say(f"Not within 20 mm of their places, and left where they are: robots {named}")

    # --- a run -------------------------------------------------------------------------------------------------------

    def _play(self, seed: int) -> None:
        """Play the run of a seed, from where it stands."""
        standing, self._standing = self._standing, None
        if standing is not None and standing.case != self.case:
            raise MissionError(f"the run to be resumed was of {standing.case}, and {self.case} is what is there now")
        gone_on = None if self._session.lockstep else standing
        again = self._again = standing if self._session.lockstep else None  # there the same steps lead to the same place
        self._before = () if gone_on is None else gone_on.absences
        self._place(seed, resumed=gone_on is not None)
        self._session.series(f"{self.case}, seed {seed}")
        mission = self._mission = self._begun(seed, gone_on)
        self._display.begin(seed, mission)
        mission.begin()
        self._saved_at = mission.history.seconds
        self._state = mission.adviser.state_dict()
        while not mission.finished:
            mission.step()
            self._state = mission.adviser.state_dict()
            if again is not None and mission.step_number == again.history.steps:
                self._compare(mission, again)
            if mission.history.seconds - self._saved_at >= CHECKPOINT_EVERY:
                self._saved_at = mission.history.seconds
                self.save()
        self.finished.append(SurroundOutcome(seed, self.case, mission.history, self._tables(mission), self._absences(mission)))
        self._mission, self._state, self._again = None, None, None
        self._job.outputs.save(seed, self.finished[-1].tables)
        self.save()
        self._job.outputs.ended(self.finished[-1])

    def _begun(self, seed: int, gone_on: StandingRun | None) -> SurroundMission:
        """The run of a seed, to be played, or gone on with."""
        host = SwarmHost(
            self._swarm,
            self._cast,
            deadline=self._job.deadline,
            observers=self._session.observers(),
        )
        if gone_on is None:
            tables = None if self._job.tables is None else tables_of(self._job.tables)
            adviser = new_adviser(self._settings, self.case, seed, tables)
        else:
            adviser = Surround.from_state(gone_on.adviser)
        return SurroundMission(
            host,
            self._settings,
            self.case,
            adviser,
            self._sensing(host),
            seed=seed,
            observers=(*self._session.observers(), self._display),
            history=None if gone_on is None else gone_on.history,
        )

    def _compare(self, mission: SurroundMission, again: StandingRun) -> None:
        """See that the steps that are made again lead where they led before."""
        if mission.digest() != again.digest:
            raise MissionError(
                f"step {mission.step_number} does not come out as it did before the run was cut: this is another version of "
                "the program, or another table. Begin anew without --resume"
            )

    def _absences(self, mission: SurroundMission) -> tuple[Absence, ...]:
        return (*self._before, *mission.host.absences)

    def _tables(self, mission: SurroundMission) -> Tables:
        return mission.adviser.tables(str(self.case))
