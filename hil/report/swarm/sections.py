"""The part of a report that tells of the surround task."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from firmware_protocol.vocabulary import RobotClass
from hil.report.page import Pictures, Section, add_picture
from hil.report.swarm.distance_figures import distances
from hil.report.swarm.experience_figures import MOST_STIMULI, behaviours, stimuli, stimulus_curves
from hil.report.swarm.place_figures import snapshots, trajectories
from hil.report.swarm.rule_figures import rings
from hil.report.swarm.runs import surround_runs
from hil.report.swarm.search_figures import conditions, evolution
from hil.report.swarm.search_words import conditions_table
from hil.report.swarm.searches import searches_of
from hil.report.swarm.words import measures_table, missing_table, rules_table, steps_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.report.run_data import RunData
    from hil.report.swarm.runs import SurroundRun

MEANS = " Of several seeds it is the mean, and the paler band its 95 % interval."


def surround_sections(data: RunData, pictures: Pictures) -> list[Section]:
    """What came of a surround mission.

    Args:
        data: The log.
        pictures: How pictures come about.
    """
    runs = surround_runs(data)
    if not runs:
        return []
    missing = Section("Who was missing")
    absent = missing_table(data)
    if absent:
        missing.tables.append(absent)
    else:
        missing.text.append("Nobody: every robot that was asked has answered.")
    return [
        _close(runs, pictures),
        _places(runs, pictures, chosen=data.steps is not None),
        _learnt(runs, pictures, data.oddities),
        _met(runs, pictures),
        missing,
    ]


def search_sections(data: RunData, pictures: Pictures) -> list[Section]:
    """What came of searches among conditions.

    Args:
        data: The log.
        pictures: How pictures come about.
    """
    searches = searches_of(data)
    if not searches:
        return []
    several = len(searches) > 1
    section = Section("What was found", tables=[conditions_table(searches)])
    name = searches[0].fitness.name
    add_picture(
        section,
        "evolution",
        partial(evolution, searches),
        f"{name} fitness of the best and the mean of each generation, one run each, and the mean that its elite came to when "
        "it was run again with other seeds (Figs. 9.9 to 9.12)."
        + (" Thin lines are single searches, thick ones their mean with its 95 % interval." if several else ""),
        pictures,
    )
    if not searches[0].generations:
        add_picture(
            section,
            "conditions",
            partial(conditions, searches[0]),
            f"{name} fitness of every condition that was run, with its 95 % interval, the best first: black for short sensors, "
            "grey for long ones. Below, which letters each has, and at the right the mean over all that have it."
            + (f" Of the first search, seed {searches[0].seed}." if several else ""),
            pictures,
        )
    return [section]


def _close(runs: Sequence[SurroundRun], pictures: Pictures) -> Section:
    section = Section("How close they came", tables=[steps_table(runs)])
    several = " Thin lines are single seeds, thick ones their mean with its 95 % interval; behaviours are of the first."
    caption = (
        "Mean distance from a RANGER to the nearest WILD, and share of WILDs with three RANGERs or more within R0; mean "
        "distance between two RANGERs; and how many RANGERs chose each behaviour in each step (Fig. 8.2)."
    )
    add_picture(section, "distances", partial(distances, runs), caption + ("" if len(runs) == 1 else several), pictures)
    told = measures_table(runs)
    section.tables += [told] if told else []
    return section


def _places(runs: Sequence[SurroundRun], pictures: Pictures, *, chosen: bool) -> Section:
    section = Section("Where they were")
    of = "" if len(runs) == 1 else f" Of the first run, seed {runs[0].seed}."
    add_picture(
        section,
        "snapshots",
        partial(snapshots, runs[0]),
        f"Where all robots have said that they are, seen from above and to scale; axes in units of the book (Fig. 7.3).{of}",
        pictures,
    )
    add_picture(
        section,
        "trajectories",
        partial(trajectories, runs[0], chosen=chosen),
        ("Their ways in the steps that were chosen" if chosen else "Their ways in the first ten steps and in the next ten")
        + f"; discs show where they have come to (Figs. 8.19, 9.5).{of}",
        pictures,
    )
    return section


def _learnt(runs: Sequence[SurroundRun], pictures: Pictures, oddities: list[str]) -> Section:
    section = Section("What was learnt")
    of = "" if len(runs) == 1 else f" Of the first run, seed {runs[0].seed}."
    add_picture(
        section,
        "rules",
        partial(rings, runs[0]),
        "What robots most likely do: the ring of sectors of a stimulus, amber where somebody of the other class is, and the "
        "chosen sector with its weight; below it what the book reports for the same stimulus (Figs. 7.5, 7.25). The nose "
        f"points up, and sectors are counted to the left from there.{of}",
        pictures,
    )
    for kind in RobotClass:
        table = rules_table(runs, kind, oddities)
        section.tables += [table] if table else []
    return section


def _met(runs: Sequence[SurroundRun], pictures: Pictures) -> Section:
    section = Section("What they met and did")
    means = "" if len(runs) == 1 else MEANS
    for kind, name in ((RobotClass.RANGER, "stimuli"), (RobotClass.WILD, "stimuli-wilds")):
        count = len(stimulus_curves(runs, kind))
        if not count:
            continue
        which = f"The {MOST_STIMULI} of {count} stimuli that were met most." if count > MOST_STIMULI else ""
        add_picture(
            section,
            name,
            partial(stimuli, runs, kind),
            f"How many {kind.name}s met a stimulus in each step, and below it the weight of each behaviour as it was known "
            f"then, told every ten steps (Figs. 7.1, 7.4, 8.1). {which}{means}",
            pictures,
        )
    add_picture(
        section,
        "behaviours",
        partial(behaviours, runs),
        f"How many RANGERs selected each behaviour in each step, and its share of all that were selected (Fig. 7.2).{means}",
        pictures,
    )
    return section
