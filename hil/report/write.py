"""Makes the report of a log: one page and its pictures."""

from __future__ import annotations

from contextlib import nullcontext, suppress
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import BoutOutcome
from hil.files.outputs import write_output
from hil.look.viewers.layouts import JUNIOR, SWARM, layout_of
from hil.mcaplog.errors import LogError
from hil.mcaplog.limits import lifted
from hil.report.bout_figures import choose, times_to_win, trajectories
from hil.report.curve_figures import fitness_by_generation, fitness_by_maneuvers
from hil.report.gather import gather
from hil.report.happened.course_figures import time_line
from hil.report.happened.words import happenings_table, states_table
from hil.report.learning_figures import known, maneuver_strips, wins_over_run
from hil.report.link_figures import link_quality, sensors_over_time
from hil.report.page import Picture, Pictures, Section, add_picture, render
from hil.report.report_table import counted, shortened
from hil.report.style import INSTALL, can_draw, styled
from hil.report.swarm.runs import see_steps, surround_runs
from hil.report.swarm.search_words import search_numbers
from hil.report.swarm.sections import search_sections, surround_sections
from hil.report.swarm.words import surround_numbers
from hil.report.team.figures import wins_of_runs
from hil.report.team.words import exam_table, runs_table
from hil.report.words import (
    bout_table,
    chosen_caption,
    coaching_bouts,
    effort_table,
    learnt_table,
    link_table,
    main_series,
    metadata_tables,
    oddity_table,
    played_bouts,
    summary,
    title_of,
)

if TYPE_CHECKING:
    from pathlib import Path

    from hil.report.run_data import RunData

PAGE = "report.html"
EARLY: Final = frozenset({"maneuvers", "fitness", "learning", "wins", "trajectories", "runs"})
"""Pictures of the coaching alone."""


@dataclass(frozen=True)
class ReportFiles:
    """What a report consists of.

    Attributes:
        page: The HTML page; it holds the pictures and needs no other file.
        pictures: The pictures again, as files: SVG drawings, PNG where a drawing would be huge or pixels were asked for.
        layout: Layout for viewing the log in Foxglove.
        title: The report's headline.
        summary: What happened, in words.
        health: What is wrong with the log, in words; empty where nothing is.
    """

    page: Path
    pictures: tuple[Path, ...]
    layout: Path
    title: str
    summary: tuple[str, ...]
    health: str = ""


def write_report(
    log: Path,
    folder: Path,
    *,
    max_chunk: int | None = None,
    steps: tuple[int, int | None] | None = None,
    png: bool = False,
) -> ReportFiles:
    """Report on a log.

    Args:
        log: The log, whole or cut off.
        folder: Where the report goes; made where it does not exist.
        max_chunk: The log is in order, and its chunks unpack to up to this many MiB; None: the usual limits hold.
        steps: First and last step of the surround task that are shown; None for the last: to the end; None: all.
        png: Each picture is wanted as pixels as well.

    Returns:
        The files written.

    Raises:
        LogError: The log cannot be read, or the report cannot be written.
        StepsError: The log has no such steps.
    """
    data = gather(log, lifted(max_chunk))
    data.steps = steps
    see_steps(data)
    return write_pages(data, folder, Pictures(png=png))


def early_pictures(data: RunData) -> dict[str, Picture]:
    """Those pictures of a coaching run that are as they will be as soon as the coaching is over.

    Args:
        data: The run so far.

    Returns:
        Pictures by name; without those that can't be drawn.
    """
    if not can_draw():
        return {}
    pictures = Pictures()
    with styled():
        sections = (_learnt(data, pictures), _learning(data, pictures), _bouts(data, pictures))
    return {picture.name: picture for section in sections for picture in section.pictures if picture.name in EARLY}


def write_pages(data: RunData, folder: Path, pictures: Pictures = Pictures()) -> ReportFiles:  # noqa: B008 - frozen
    """Draw and write a report of what has been gathered.

    Args:
        data: It.
        folder: Where the report goes; made where it does not exist.
        pictures: How its pictures come about: some may be drawn already.

    Returns:
        The files written.

    Raises:
        LogError: The report cannot be written.
    """
    with styled() if can_draw() else nullcontext():
        sections = _sections(data, pictures)
    said = summary(data)
    title = title_of(data)
    footer = f"Made by {_program(data)} from {data.path.name}."
    page = render(title, _subtitle(data), said, numbers=_numbers(data), sections=sections, footer=footer)
    layout = layout_of(SWARM if data.surround or data.evaluations else JUNIOR)
    drawn = {name: content for section in sections for picture in section.pictures for name, content in picture.files().items()}
    try:
        for name, content in drawn.items():
            write_output(folder / name, content, overwrite=True)
        write_output(folder / layout.name, layout.read_bytes(), overwrite=True)
        write_output(folder / PAGE, page.encode(), overwrite=True)  # the last: where it is, the report is whole
    except OSError as error:
        with suppress(OSError):
            folder.rmdir()  # where nothing is in it
        raise LogError(f"cannot write the report to {folder}: {error.strerror}") from error
    paths = tuple(folder / name for name in drawn)
    return ReportFiles(folder / PAGE, paths, folder / layout.name, title, tuple(said), "" if data.whole else data.health)


def _sections(data: RunData, pictures: Pictures) -> list[Section]:
    found = [
        _happened(data, pictures),
        _learnt(data, pictures),
        _learning(data, pictures),
        _bouts(data, pictures),
        *surround_sections(data, pictures),
        *search_sections(data, pictures),
    ]
    if not data.evaluations:  # of runs that had their own tables
        found.append(_link(data, pictures))
    if data.of_junior:
        found.insert(1, _sensed(data, pictures))
    about = Section("About this run")
    if not can_draw():
        about.text.append(f"There are no pictures here, since matplotlib is not installed: {INSTALL} adds them.")
    if data.learnt and not all(known((trial.previous, trial.current)) for trial in data.trials):
        data.oddities.append("Trials of situations that this program does not know are counted, and not drawn.")
    odd = oddity_table(data)
    about.tables = [table for table in (odd,) if table]
    about.folded = metadata_tables(data)
    return [*found, about]


def _happened(data: RunData, pictures: Pictures) -> Section:
    section = Section("What happened")
    course = data.course
    if course.networks > 1 and course.states:
        section.text.append(
            f"The robots were on {course.networks} networks; those of the same number on several of them are told of as one."
        )
    many = len(course.states) > 1
    add_picture(
        section,
        "course",
        partial(time_line, data),
        f"In which state {'the robots were' if many else 'the robot was'}, as far as it was told: about once a second, and "
        "whenever it was asked for. Below, when something happened: the table says what.",
        pictures,
    )
    section.tables = [table for table in (states_table(data), happenings_table(data)) if table]
    return section


def _learnt(data: RunData, pictures: Pictures) -> Section:
    section = Section("What Junior learnt")
    table = learnt_table(data)
    if table:
        add_picture(
            section,
            "maneuvers",
            partial(maneuver_strips, data),
            "The best maneuver for each thing the eyes see: how fast the left (L) and the right wheel (R) turn in each action.",
            pictures,
        )
        section.tables.append(table)
    return section


def _learning(data: RunData, pictures: Pictures) -> Section:
    section = Section("How it learnt")
    add_picture(
        section,
        "fitness",
        partial(fitness_by_generation, data),
        "Best fitness by generation. A category makes a step when all of its maneuvers are rated, so situations that come up "
        "often make many steps, and the curves have different lengths.",
        pictures,
    )
    add_picture(
        section,
        "learning",
        partial(fitness_by_maneuvers, data),
        "The same against the maneuvers performed. In the exam (grey) the best of each category are tested again.",
        pictures,
    )
    if data.learnt:
        add_picture(
            section,
            "wins",
            partial(wins_over_run, data, coaching_bouts(data)),
            "Share of bouts won during coaching, with maneuvers on trial; each tick above is a bout.",
            pictures,
        )
    add_picture(
        section,
        "runs",
        partial(wins_of_runs, data),
        "Share of the last 20 bouts won by each run while it learnt, with maneuvers on trial.",
        pictures,
    )
    section.tables = [table for table in (effort_table(data), runs_table(data), exam_table(data)) if table]
    return section


def _bouts(data: RunData, pictures: Pictures) -> Section:
    section = Section("Bouts")
    table = bout_table(data)
    if table is None:
        return section
    section.tables.append(table)
    if coaching_bouts(data):
        early = choose(coaching_bouts(data), learnt=True)
        add_picture(
            section,
            "trajectories",
            partial(trajectories, early),
            f"Bouts of the coaching, first, middle and last ({chosen_caption(early)}), seen from above. "
            "Dashed: where they started; filled: where they ended.",
            pictures,
        )
    played = played_bouts(data)
    first = [bout for bout in played if bout.series == main_series(played)]
    shown = choose(first, learnt=False)
    name = shortened(first[0].series, 100) if first and first[0].series else "bouts"
    add_picture(
        section,
        "bouts",
        partial(trajectories, shown),
        f"A few {name} ({chosen_caption(shown)}), seen from above. Dashed: where they started; filled: where they ended.",
        pictures,
    )
    add_picture(section, "times", partial(times_to_win, played), "How long it took to win.", pictures)
    return section


def _link(data: RunData, pictures: Pictures) -> Section:
    section = Section("The link")
    add_picture(
        section,
        "link",
        partial(link_quality, data),
        "Left: frames from the robot over the run. Right: how long an acknowledgement or a time comparison took, where the "
        "question had to be asked only once.",
        pictures,
    )
    section.tables.append(link_table(data))
    return section


def _sensed(data: RunData, pictures: Pictures) -> Section:
    section = Section("Sensors and wheels")
    marked = any(event.kind in {"link", "safety"} for _, event in data.events)
    lines = " Amber lines mark events of the link and of safety." if marked else ""
    caption = f"What Junior sensed, and what its wheels were told.{lines}"
    add_picture(section, "sensors", partial(sensors_over_time, data), caption, pictures)
    return section


def _subtitle(data: RunData) -> str:
    config, run = data.metadata.get("config", {}), data.metadata.get("run", {})
    parts = [
        data.path.name,
        f"seed {config['seed']}" if config.get("seed") else "",
        run.get("started", "").replace("T", " ")[:16],
        run.get("command", ""),
    ]
    return " · ".join(shortened(part, 300) for part in parts if part)


def _numbers(data: RunData) -> list[tuple[str, str]]:
    found: list[tuple[str, str]] = []
    stops = len(data.course.stops())
    if stops:
        found.append((f"{stops:,}", "emergency stop" if stops == 1 else "emergency stops"))
    if data.surround:
        found += surround_numbers(surround_runs(data))
    if data.evaluations:
        found += search_numbers(data)
    if data.learnt:
        performed = sum(run.maneuvers for run in data.coached) or len(data.trials)
        by = f" by {counted(len(data.coached), 'robot', 'robots')}" if data.coached else ""
        found.append((f"{performed:,}", f"maneuvers performed{by}"))
    over = [bout for bout in data.bouts if bout.outcome is not BoutOutcome.UNDECIDED]
    if over:
        found.append((f"{len(over):,}", "bouts"))
    scored = played_bouts(data) or over
    if scored:
        series = main_series(scored) if data.learnt else ""
        those = [bout for bout in scored if bout.series == series or not data.learnt]
        decided = [bout for bout in those if bout.outcome is not BoutOutcome.UNDECIDED]
        if decided:
            wins = sum(bout.outcome is BoutOutcome.WIN for bout in decided)
            found.append((f"{wins / len(decided):.1%}", f"won, {shortened(series, 60)}" if series else "of the bouts won"))
    if data.duration:
        long = data.duration >= 120
        found.append((f"{data.duration / 60:.1f} min" if long else f"{data.duration:.1f} s", "of log time"))
    if data.link.good:
        found.append((f"{data.link.loss:.2%}", "of the robot’s frames lost"))
    return found


def _program(data: RunData) -> str:
    return f"junior-hil {data.metadata.get('config', {}).get('version', '')}".strip()
