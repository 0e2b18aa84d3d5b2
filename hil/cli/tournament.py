"""`hil tournament`: robots against robots."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from hil import runs
from hil.cli import common
from hil.cli.run_files import RunFiles
from hil.cli.running import ActiveRun, running
from hil.cli.stage import LiveStage
from hil.cli.swarm import options
from hil.cli.swarm.resuming import CutKind, CutRun
from hil.cli.tournament_words import entrant_of, matrix_table, seat_line, standings_table
from hil.files.outputs import replace_file
from hil.jobs.duel import DuelJob
from hil.sumo.tournament.checkpoint import DOOR, TournamentCheckpoint, load_checkpoint
from hil.sumo.tournament.schedule import MOST_BOUTS, Tournament, play_part
from hil.sumo.tournament.standings import Standings
from hil.terminal.bars import bar
from hil.terminal.interrupts import interrupts
from hil.working.processes import cores

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from hil.sumo.tournament.schedule import TournamentBout

TOURNAMENT: Final[CutKind[TournamentCheckpoint]] = CutKind(
    "tournament", "hil tournament", DOOR, load_checkpoint, lambda saved: saved.finished
)
LINES: Final = 10
"""So often it is said how far it has come, where no bar is shown."""


def tournament(
    context: typer.Context,
    entrants: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="ENTRANT...",
            help="An advice file or the run that made it, played by a host; memory:FILE, played by the robot itself; a policy "
            "file; chase, chase2, hobby or random. NAME=ENTRANT gives it a name.",
            show_default=False,
        ),
    ] = None,
    *,
    bouts: Annotated[
        int, typer.Option("--bouts", min=2, max=MOST_BOUTS, help="Bouts of each pairing, half of them in each seat.")
    ] = 20,
    upsets: Annotated[
        int, typer.Option("--upsets", min=0, max=100, metavar="N", help="Logs of as many bouts that the weaker won.")
    ] = 5,
    workers: Annotated[
        int | None,
        common.workers_option("Play in N processes, with the same result for every N; as many as there are cores if left out."),
    ] = None,
    scheduler: options.SchedulerOption = None,
    png: Annotated[bool, typer.Option("--png", help="The picture in pixels as well.")] = False,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the newest tournament that did not finish.")] = False,
    resume_from: options.ResumeFromOption = None,
    checkpoint: options.CheckpointOption = None,
    seed: common.SeedOption = 1,
    out: common.OutOption = None,
    overwrite: common.OverwriteOption = False,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,
) -> int:
    """Let robots play against each other, and say how strong each is.

    Examples: hil tournament chase chase2 hobby random; hil tournament runs/* memory:runs/first --bouts 40
    """
    console = common.consoles(as_json=as_json, quiet=quiet)
    begun = CutRun(TOURNAMENT, context, link="", resume=resume, resume_from=resume_from, checkpoint=checkpoint)
    if (saved := begun.saved) is None:
        saved = TournamentCheckpoint(_begin(entrants or [], bouts, seed))
    elif entrants:
        raise common.UsageError("a tournament that is gone on with has its entrants: leave them out, or leave --resume out")
    begun.check({"bouts": bouts, "seed": seed}, {"bouts": saved.tournament.bouts, "seed": saved.tournament.seed})
    with running(
        TOURNAMENT.verb,
        f"{len(saved.tournament.entrants)}-entrants",
        url="sim://junior",
        emulated_here=True,
        seed=saved.tournament.seed,
        out=out,
        no_log=True,
        overwrite=overwrite,
        makes={runs.CHECKPOINT: checkpoint, runs.TOURNAMENT_PICTURE: None},
        kept=(checkpoint,) if checkpoint is not None and begun.goes_on_in(checkpoint) else (),
    ) as run:
        if begun.source is not None:
            run.describe(resumed_from=str(begun.source))
            console.print(f"Going on from {begun.source}: {len(saved.bouts)} bouts.", markup=False)
        elif not quiet:
            console.print(_headline(saved.tournament), markup=False)
        files = RunFiles(run, checkpoint, console, report=False)
        played = _Playing(files, saved, console, quiet=quiet)
        with interrupts():
            played.play(workers or cores(), scheduler)
            standings = Standings.of(saved.tournament, played.bouts)
            document = {
                **standings.to_dict(),
                "upsets": _record_upsets(run, standings, upsets, config),
                "picture": _draw(run, standings, console, png=png),
                "checkpoint": str(files.checkpoint),
                "run": run.folder,
            }
        first = standings.name(standings.order[0])
        run.finish({**document, "summary": f"{first} is the strongest of {len(standings.order)}"})
    with run.telling():
        if as_json:
            common.print_json(document)
        else:
            _tell(console, standings, document, quiet=quiet)
    return run.ended()


def _begin(entrants: Sequence[str], bouts: int, seed: int) -> Tournament:
    """A tournament as it was asked for.

    Raises:
        UsageError: It can't be held.
        HilError: What an entrant has learnt can't be read.
    """
    try:
        return Tournament(tuple(map(entrant_of, entrants)), bouts, seed)
    except ValueError as error:
        raise common.UsageError(str(error)) from error


def _headline(tournament: Tournament) -> str:
    entrants, each = len(tournament.entrants), tournament.bouts
    return f"{entrants} entrants, {entrants * (entrants - 1) // 2} pairings, {each} bouts each: {tournament.total} bouts."


class _Playing:
    """The bouts, as far as they have been played.

    Args:
        files: Where the run leaves what.
        saved: What is gone on from.
        console: Where a bar, or lines, go.
        quiet: Show nothing.

    Attributes:
        bouts: What was played.
    """

    def __init__(self, files: RunFiles, saved: TournamentCheckpoint, console: Console, *, quiet: bool) -> None:
        self._files = files
        self._tournament = saved.tournament
        self._console = console
        self._quiet = quiet
        self.bouts: list[TournamentBout] = list(saved.bouts)
        self._saved = 0

    def play(self, workers: int, scheduler: str | None) -> None:
        """Play what is left.

        Args:
            workers: Processes.
            scheduler: Address of a Dask scheduler whose workers play instead.

        Raises:
            WorkerError: Bouts could not be played.
            KeyboardInterrupt: The operator asked for it; what was played is saved.
        """
        left, total = len(self.bouts), self._tournament.total
        parts = []
        for part in self._tournament.parts():
            if left < part.size:
                parts.append(part)
            left = max(0, left - part.size)
        alive = self._console.is_terminal and not self._quiet
        self._save()
        try:
            with (
                bar(self._console, shown=alive) as progress,
                options.crew_of(workers, scheduler) as crew,
            ):
                assert crew is not None, "there are workers"
                task = progress.add_task("Playing", total=total, completed=len(self.bouts))
                for bouts in crew.in_order(play_part, parts):
                    before = len(self.bouts)
                    self.bouts += bouts
                    if len(self.bouts) - self._saved >= total / 100:
                        self._save()
                    progress.update(task, completed=len(self.bouts))
                    if not alive and not self._quiet and len(self.bouts) * LINES // total > before * LINES // total:
                        self._console.print(f"{len(self.bouts)}/{total} bouts")
            self._save()
        except BaseException:
            self._save()  # an interrupt may have come between bouts and their checkpoint
            self._files.tell_where(f"The {len(self.bouts)} bouts that were played are", ["hil", "tournament"])
            raise

    def _save(self) -> None:
        self._files.save_checkpoint(TournamentCheckpoint(self._tournament, tuple(self.bouts)).to_bytes())
        self._saved = len(self.bouts)


def _record_upsets(run: ActiveRun, standings: Standings, most: int, config: Path | None) -> list[dict[str, object]]:
    """Play the bouts that the weaker has won once more, with logs: the same bouts, for nothing but their seeds decides."""
    assert run.run is not None
    found: list[dict[str, object]] = []
    tournament = standings.tournament
    for number, upset in enumerate(standings.upsets(most), start=1):
        bout = upset.bout
        winner, loser = (
            tournament.entrants[one].name for one in (bout.home, bout.away)[:: 1 if bout.winner == bout.home else -1]
        )
        log = run.run.folder / f"upset-{number:0{len(str(most))}}-{winner}-{loser}.mcap"
        job = DuelJob(
            tournament.entrants[bout.home], tournament.entrants[bout.away], tournament.seed_of(bout.round, bout.home, bout.away)
        )
        recorded = ActiveRun(None, log, overwrite=False)
        stage = LiveStage(
            recorded, job, job.url, common.plain_console(stderr=True, quiet=True), quiet=True, options=config, beside=False
        )
        with closing(stage):
            job.perform(stage)
        run.failures.extend(recorded.failures)
        found.append(
            {
                "winner": winner,
                "loser": loser,
                "round": bout.round,
                "winner_seat": "home" if bout.winner == bout.home else "away",
                "time_s": bout.time,
                "probability": round(upset.probability, 4),
                "log": recorded.log_file,
            }
        )
    return found


def _draw(run: ActiveRun, standings: Standings, console: Console, *, png: bool) -> str | None:
    """Draw the picture, where what draws is installed; where it is."""
    from hil.report.style import INSTALL, can_draw, styled  # noqa: PLC0415 - drawing takes half a second to load
    from hil.report.style import png as pixels  # noqa: PLC0415
    from hil.report.style import svg as drawing  # noqa: PLC0415

    if not can_draw():
        console.print(f"There is no picture: {INSTALL} and hil tournament --resume-from {run.folder} draw it.", markup=False)
        return None
    from hil.sumo.tournament.picture import tournament_picture  # noqa: PLC0415

    path = run.place(None, runs.TOURNAMENT_PICTURE)
    with styled():
        picture = tournament_picture(standings)
        contents = {path: drawing(picture, "tournament").encode()}
        if png:
            contents[path.with_suffix(".png")] = pixels(picture)
    try:
        for place, data in contents.items():
            replace_file(place, data)
    except OSError as error:
        run.failed(f"cannot write the picture {path}: {error.strerror}")
        return None
    return str(path)


def _tell(console: Console, standings: Standings, document: dict[str, object], *, quiet: bool) -> None:
    """Say what came of it, and where the files are."""
    console.print(standings_table(standings))
    console.print(matrix_table(standings, console.width))
    if quiet:
        return
    console.print(seat_line(standings), markup=False)
    upsets = document["upsets"]
    assert isinstance(upsets, list)
    if upsets:
        console.print("Bouts that the weaker won, the least probable first (hil view LOG shows one, hil replay LOG checks it):")
    for upset in upsets:
        probable = f"{100 * upset['probability']:.1f} % probable"
        console.print(
            f"  {upset['winner']} beat {upset['loser']} in {upset['time_s']:.1f} s, {probable}: {upset['log']}", markup=False
        )
    if document["picture"] is not None:
        console.print(f"Picture: {document['picture']}", markup=False)
