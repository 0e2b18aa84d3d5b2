"""`hil swarm surround`: RANGERs learn to surround WILDs."""

from __future__ import annotations

import sys
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from firmware_protocol.address import parse_address
from firmware_protocol.errors import AddressError
from hil import runs
from hil.cli import common
from hil.cli import live as live_options
from hil.cli import share as share_options
from hil.cli.links import all_settled
from hil.cli.running import ActiveRun, running
from hil.cli.stage import LiveStage
from hil.cli.swarm import options
from hil.cli.swarm.evolve import SearchRequest, check_unsearched, evolve_conditions
from hil.cli.swarm.resuming import SURROUND, CutRun
from hil.cli.swarm.surround_files import SurroundFiles
from hil.connecting.connecting_all import GATHER
from hil.jobs.swarm.seeds import SeedsJob
from hil.jobs.swarm.surround import MissionOutputs, SurroundJob
from hil.swarm.missions.surround_run import emulated_table
from hil.swarm.missions.surround_settings import MOST_LENGTH, MOST_STEPS, Order, SurroundSettings
from hil.swarm.missions.tables_file import load_conditional, load_tables, tables_text
from pal_advisor.fields import SettingsError
from pal_advisor.surround import Case, CaseError, Sensing
from pal_advisor.surround.measures import Fitness
from pal_advisor.surround.search import SearchName, SearchSettings
from pal_advisor.surround.search.searches import MOST_BUDGET, MOST_GENERATIONS, MOST_POPULATION, MOST_REPEATS
from pal_advisor.surround.settings import MOST_GAIN, MOST_ROUNDS
from pal_advisor.surround.stimuli import MOST_SECTORS

if TYPE_CHECKING:
    from rich.console import Console

    from hil.swarm.missions.surround_checkpoint import SurroundCheckpoint

DEFAULTS = SurroundSettings()
FITNESSES = ", ".join(Fitness)
SEARCH = SearchSettings()
DECIDING = (
    "case", "steps", "order", "sensing", "sectors", "feasible", "mutate_after", "no_learning", "r0", "eta", "dr", "gain",
    "wild_step", "unit", "seed", "seeds",
)  # fmt: skip
"""Options that a run that is gone on with has been begun with."""
CASE = str(Case())


def surround(
    context: typer.Context,
    links: options.LinksArgument = None,
    *,
    case: Annotated[
        str,
        typer.Option("--case", help=f"Conditions by the book's name; the rest is as in {CASE}.", show_default=False),
    ] = "",
    steps: Annotated[int, typer.Option("--steps", min=0, max=MOST_STEPS, help="Steps.")] = DEFAULTS.steps,
    order: Annotated[Order, typer.Option("--order", help="Who moves at once.")] = DEFAULTS.order,
    sensing: Annotated[Sensing, typer.Option("--sensing", help="What makes the stimulus.")] = DEFAULTS.sensing,
    sectors: Annotated[
        int, typer.Option("--sectors", min=1, max=MOST_SECTORS, help="Sectors of a ring, and behaviours.")
    ] = DEFAULTS.sectors,
    feasible: Annotated[
        str, typer.Option("--feasible", metavar="MASK", help="Behaviours that robots can perform, B1 first, as 11110000.")
    ] = "",
    conditional: Annotated[
        Path | None, typer.Option("--conditional", metavar="FILE", help="TOML file of behaviours that are given for stimuli.")
    ] = None,
    mutate_after: Annotated[
        int,
        typer.Option(
            "--mutate-after",
            min=0,
            max=MOST_ROUNDS,
            metavar="K",
            help="A RANGER whose weights did not change for K rounds does something at random once; 0 is never.",
        ),
    ] = 0,
    no_learning: Annotated[bool, typer.Option("--no-learning", help="Weights stay as they are: a control run.")] = False,
    r0: Annotated[float, typer.Option("--r0", min=1e-3, max=MOST_LENGTH, help="Radius of the rings, in units.")] = DEFAULTS.r0,
    eta: Annotated[
        float, typer.Option("--eta", min=1e-3, max=MOST_LENGTH, help="A RANGER's step, as a share of it.")
    ] = DEFAULTS.eta,
    dr: Annotated[
        float, typer.Option("--dr", min=0, max=MOST_LENGTH, help="How much a radius grows at a time, in units.")
    ] = DEFAULTS.dr,
    gain: Annotated[float, typer.Option("--gain", min=0, max=MOST_GAIN, help="c of the increment C1.")] = DEFAULTS.gain,
    wild_step: Annotated[
        float, typer.Option("--wild-step", min=0, max=MOST_LENGTH, help="A WILD's step, as a share of a RANGER's.")
    ] = DEFAULTS.wild_step,
    unit: Annotated[
        float, typer.Option("--unit", min=1e-3, max=MOST_LENGTH, metavar="METRES", help="Length of the book's unit, in m.")
    ] = DEFAULTS.unit,
    table_in: Annotated[
        Path | None, typer.Option("--table-in", metavar="FILE", help="Go on from what was learnt elsewhere.")
    ] = None,
    table_out: Annotated[
        Path | None,
        typer.Option(
            "--table-out", metavar="FILE", help="Where what was learnt goes, instead of tables.toml in the run's folder."
        ),
    ] = None,
    require: Annotated[
        float | None,
        typer.Option("--require", min=0, max=1, metavar="SHARE", help="Exit 1 if fewer WILDs are surrounded at the end."),
    ] = None,
    evolve: Annotated[
        Fitness | None,
        typer.Option("--evolve", help="Look for the conditions (B, D, L, S) that suit the group best, by this fitness."),
    ] = None,
    search: Annotated[SearchName, typer.Option("--search", help="How, with --evolve.")] = SEARCH.search,
    population: Annotated[
        int, typer.Option("--population", min=2, max=MOST_POPULATION, help="Individuals of a generation.")
    ] = SEARCH.population,
    generations: Annotated[
        int, typer.Option("--generations", min=1, max=MOST_GENERATIONS, help="Generations of the genetic search.")
    ] = SEARCH.generations,
    repeats: Annotated[
        int,
        typer.Option("--repeats", min=1, max=MOST_REPEATS, help="Runs for each mean that is told, all of the same seeds."),
    ] = SEARCH.repeats,
    budget: Annotated[
        int | None,
        typer.Option(
            "--budget",
            min=1,
            max=MOST_BUDGET,
            metavar="N",
            help="Runs of a random search [default: as many as the genetic one]",
        ),
    ] = None,
    place: options.PlaceOption = None,
    ring: options.RingOption = None,
    poses: options.PosesOption = None,
    quorum: options.QuorumOption = options.QUORUM,
    spare: options.SpareOption = False,
    deadline: options.DeadlineOption = None,
    no_fence: options.NoFenceOption = False,
    live: live_options.LiveOption = False,
    open_page: live_options.OpenOption = None,
    public: live_options.PublicOption = False,
    share: share_options.ShareOption = None,
    viewer: live_options.ViewerOption = None,
    yes: options.YesOption = False,
    no_input: options.NoInputOption = False,
    reconnect: common.ReconnectOption = common.RECONNECT,
    resume: options.ResumeOption = False,
    resume_from: options.ResumeFromOption = None,
    checkpoint: options.CheckpointOption = None,
    report: options.ReportOption = True,
    signing_key: common.SigningKeyOption = None,
    seed: common.SeedOption = 1,
    seeds: options.SeedsOption = 1,
    workers: options.WorkersOption = None,
    scheduler: options.SchedulerOption = None,
    out: common.OutOption = None,
    log: common.LogOption = None,
    no_log: common.NoLogOption = False,
    overwrite: common.OverwriteOption = False,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,
) -> int:
    """Let RANGERs learn to surround WILDs, and leave tables, log and report.

    Examples: hil swarm surround; hil swarm surround --case B2D3 --seeds 8 --workers 2; hil swarm surround tcp://127.0.0.1:5760
    """
    page = live_options.live_page(live, open_page, public=public, no_log=no_log, viewer=viewer)
    console = common.consoles(as_json=as_json, quiet=quiet)
    options.check_side_by_side(links, workers=workers, scheduler=scheduler, place=place, poses=poses, signing_key=signing_key)
    if evolve is None:
        links = all_settled(links, yes=yes, quiet=quiet, signing_key=signing_key)
    shared = share_options.shared_address(share, links, "surround", no_log=no_log)
    settings = _settings(
        case=case,
        steps=steps,
        order=order,
        sensing=sensing,
        sectors=sectors,
        feasible=feasible,
        conditional={} if conditional is None else load_conditional(conditional, sectors),
        mutate_after=mutate_after,
        learning=not no_learning,
        r0=r0,
        eta=eta,
        dr=dr,
        gain=gain,
        wild_step=wild_step,
        unit=unit,
    )
    if evolve is not None:
        asked = SearchRequest(
            context,
            settings,
            SearchSettings(evolve, search, population, generations, repeats, budget or 0),
            seed,
            seeds,
            workers=workers or 1,
            scheduler=scheduler,
            resume=resume,
            resume_from=resume_from,
            checkpoint=checkpoint,
            report=report,
            out=out,
            log=log,
            no_log=no_log,
            overwrite=overwrite,
            as_json=as_json,
            quiet=quiet,
            config=config,
        )
        return evolve_conditions(asked, console)
    check_unsearched(context)
    begun = CutRun(SURROUND, context, link=" ".join(links or ()), resume=resume, resume_from=resume_from, checkpoint=checkpoint)
    if (saved := begun.saved) is not None:
        of_runs = {"seed": saved.seed, "seeds": saved.seeds, "no_learning": not saved.settings.learning}
        begun.check({name: context.params[name] for name in DECIDING}, {**saved.settings.to_dict(), **of_runs})
        settings, seed, seeds = saved.settings, saved.seed, saved.seeds
    if seeds > 1 and table_out is not None:
        raise common.UsageError("--table-out names one file, and with --seeds each seed has its own, in the run's folder")
    urls = tuple(links) if links else (emulated_table(settings, Case.parse(settings.case), seed),)
    with (
        options.crew_of(workers, scheduler) as crew,
        running(
            SURROUND.verb,
            (settings.case.strip().upper() or "robots") if links else str(Case.parse(settings.case)),
            url=urls[0],
            emulated_here=not links,
            seed=seed,
            signing_key=signing_key,
            out=out,
            log=log,
            no_log=no_log,
            overwrite=overwrite,
            makes={runs.TABLES: table_out, runs.CHECKPOINT: checkpoint},
            kept=(checkpoint,) if checkpoint is not None and begun.goes_on_in(checkpoint) else (),
        ) as run,
    ):
        run.describe(link=" ".join(links or ()))
        files = SurroundFiles(run, table_out, checkpoint, seeds, console, report=report)
        kind = SurroundJob if crew is None else partial(SeedsJob, crew=crew)
        job = kind(
            links=urls,
            settings=settings,
            seed=seed,
            seeds=seeds,
            place=place,
            ring=None if ring is None else ring.value,
            spare=spare,
            quorum=quorum,
            deadline=deadline,
            poses=_poses(poses),
            fence=not no_fence,
            confirmed=yes,
            asks=not no_input and sys.stdin is not None and sys.stdin.isatty(),
            reconnect=reconnect,
            tables=None if table_in is None else tables_text(load_tables(table_in)).encode(),
            saved=begun.content,
            outputs=MissionOutputs(
                checkpoint=files.save_checkpoint,
                save=files.save_tables,
                cut=lambda reached: files.tell_how_to_resume(reached, links or (), signing_key),
                ended=files.ended,
                resumed=lambda saved: _tell_resumed(saved, begun, run, console),
            ),
        )
        stage = LiveStage(
            run,
            job,
            urls[0],
            console,
            quiet=quiet,
            signing_key=signing_key,
            options=config,
            reports=files.report is not None,
            page=page,
            share=shared,
            gather=GATHER,
        )
        with closing(stage):
            outcomes = job.perform(stage)
            document = files.document(outcomes, settings)
            if not as_json:  # before the report is drawn: should that fail, the outcome has been told
                files.tell(outcomes, document)
            files.draw(stage, document, announce=not as_json)
        short = require is not None and any((outcome.last_share or 0.0) < require for outcome in outcomes)
        run.finish(files.kept(document), common.EXIT_FELL_SHORT if short else common.EXIT_DONE)
    with run.telling():
        if as_json:
            common.print_json(document)
        if short:
            console.print(f"Less than the required {require:g} of the WILDs were surrounded at the end.")
    return run.ended()


def _settings(**values: Any) -> SurroundSettings:  # noqa: ANN401 - fields of the settings
    try:
        return SurroundSettings(**values)
    except SettingsError as error:
        raise common.UsageError(f"--{str(error).replace('_', '-', 1)}") from error
    except CaseError as error:
        raise common.UsageError(str(error)) from error


def _poses(text: str | None) -> str:
    """The address that poses come to."""
    if text is None:
        return ""
    address = parse_address(text)
    if address.scheme != "udpin":
        raise AddressError(text, "poses come by UDP", "Write it as udpin://127.0.0.1:14600")
    return address.url


def _tell_resumed(saved: SurroundCheckpoint, begun: CutRun[SurroundCheckpoint], run: ActiveRun, console: Console) -> None:
    run.describe(resumed_from=str(begun.source), seed=saved.seed)
    console.print(f"Going on from {begun.source}: {saved.steps} steps.", markup=False)
