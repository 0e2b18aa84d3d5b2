"""`hil swarm surround`: RANGERs learn to surround WILDs."""

from __future__ import annotations

import sys
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from firmware_protocol.address import parse_address
from firmware_protocol.errors import AddressError
from hil import runs
from hil.cli import common
from hil.cli.links import all_settled
from hil.cli.running import ActiveRun, running
from hil.cli.stage import LiveStage
from hil.cli.swarm import options
from hil.cli.swarm.resuming import VERB, CutRun
from hil.cli.swarm.surround_files import SurroundFiles
from hil.connecting.connecting_all import GATHER
from hil.jobs.swarm.surround import MissionOutputs, SurroundJob
from hil.swarm.missions.surround_settings import MOST_LENGTH, MOST_STEPS, Order, SurroundSettings
from hil.swarm.missions.tables_file import load_conditional, load_tables, tables_text
from pal_advisor.fields import SettingsError
from pal_advisor.surround import Case, CaseError, Sensing
from pal_advisor.surround.settings import MOST_GAIN, MOST_ROUNDS
from pal_advisor.surround.stimuli import MOST_SECTORS

if TYPE_CHECKING:
    from rich.console import Console

    from hil.swarm.missions.surround_checkpoint import SurroundCheckpoint

DEFAULTS = SurroundSettings()
CASE = str(Case())
MOST_OF_A_NETWORK = 253
"""Robots that one network has ids for."""


def surround(
    context: typer.Context,
    links: options.LinksArgument = None,
    *,
    case: Annotated[
        str, typer.Option("--case", help=f"Conditions by the book's name; what is left out is as in {CASE}.", show_default=CASE)
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
        float, typer.Option("--dr", min=0, max=MOST_LENGTH, help="By which the radius grows, in units.")
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
            "--table-out", metavar="FILE", help="Where to what was learnt goes, instead of tables.toml in the run's folder."
        ),
    ] = None,
    require: Annotated[
        float | None,
        typer.Option("--require", min=0, max=1, metavar="SHARE", help="Exit 1 if fewer WILDs are surrounded at the end."),
    ] = None,
    place: options.PlaceOption = None,
    ring: options.RingOption = None,
    poses: options.PosesOption = None,
    quorum: options.QuorumOption = options.QUORUM,
    spare: options.SpareOption = False,
    deadline: options.DeadlineOption = None,
    no_fence: options.NoFenceOption = False,
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
    out: common.OutOption = None,
    log: common.LogOption = None,
    no_log: common.NoLogOption = False,
    overwrite: common.OverwriteOption = False,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,
) -> int:
    """Let RANGERs learn to surround WILDs, and leave tables, log and report.

    Examples: hil swarm surround; hil swarm surround --case B2D3 --seeds 8; hil swarm surround tcp://127.0.0.1:5760
    """
    console = common.consoles(as_json=as_json, quiet=quiet)
    links = all_settled(links, yes=yes, quiet=quiet, signing_key=signing_key)
    begun = CutRun(context, link=" ".join(links or ()), resume=resume, resume_from=resume_from, checkpoint=checkpoint)
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
    begun.check(
        {
            name: context.params[name]
            for name in (
                "case", "steps", "order", "sensing", "sectors", "feasible", "mutate_after", "no_learning", "r0", "eta", "dr",
                "gain", "wild_step", "unit", "seed", "seeds",
            )
        }
    )  # fmt: skip
    if begun.saved is not None:
        settings, seed, seeds = begun.saved.settings, begun.saved.seed, begun.saved.seeds
    if seeds > 1 and table_out is not None:
        raise common.UsageError("--table-out names one file, and with --seeds each seed has its own, in the run's folder")
    urls = tuple(links) if links else (_emulated_table(settings, seed),)
    with running(
        VERB,
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
    ) as run:
        run.describe(link=" ".join(links or ()))
        files = SurroundFiles(run, table_out, checkpoint, seeds, console, report=report)
        job = SurroundJob(
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


def _emulated_table(settings: SurroundSettings, seed: int) -> str:
    """Address of the table in this process that a case asks for."""
    case = Case.parse(settings.case)
    width, height = settings.size
    networks = -(-(case.rangers + case.wilds) // MOST_OF_A_NETWORK)
    more = f"&networks={networks}" if networks > 1 else ""
    robots = f"rangers={case.rangers}&wilds={case.wilds}"
    return f"sim://swarm?{robots}&wall={int(case.wall)}&size={width:g},{height:g}&seed={seed}{more}"


def _tell_resumed(saved: SurroundCheckpoint, begun: CutRun, run: ActiveRun, console: Console) -> None:
    run.describe(resumed_from=str(begun.source), seed=saved.seed)
    console.print(f"Going on from {begun.source}: {saved.steps} steps.", markup=False)
