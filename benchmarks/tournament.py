"""A thousand bouts of robots against robots, on so many workers.

Prints wall time, and the processor time that it took, which tells what two cores of one's own would need.

    python benchmarks/tournament.py [ENTRANT...] [--bouts 1000] [--workers 2]
"""

from __future__ import annotations

import argparse
import resource
import statistics
from time import perf_counter

from hil.cli.tournament_words import entrant_of
from hil.sumo.tournament.schedule import Tournament, play_part
from hil.working import open_crew


def main() -> None:
    """Play, and tell."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("entrants", nargs="*", default=["chase", "chase2", "hobby", "random"])
    parser.add_argument("--bouts", type=int, default=1000, help="about so many, all pairings together")
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    entrants = tuple(map(entrant_of, asked.entrants))
    pairings = len(entrants) * (len(entrants) - 1) // 2
    tournament = Tournament(entrants, max(1, round(asked.bouts / pairings / 2)) * 2, 1)
    since = perf_counter()
    with open_crew(asked.workers) as crew:
        bouts = [bout for part in crew.in_order(play_part, tournament.parts()) for bout in part]
    wall = perf_counter() - since
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    work = used.ru_utime + used.ru_stime
    lasted = statistics.mean(bout.time for bout in bouts)
    print(f"{len(bouts)} bouts of {lasted:.1f} s by the mean on {asked.workers} workers: {wall:.1f} s")
    print(f"processor time {work:.1f} s, {1e3 * work / len(bouts):.1f} ms a bout")


if __name__ == "__main__":
    main()
