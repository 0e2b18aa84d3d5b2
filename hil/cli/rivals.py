"""Robots that a coaching is against, as a user names them: `--opponent chase,runs/first,self`."""

from __future__ import annotations

from firmware_protocol.address import parse_address
from firmware_protocol.near import did_you_mean
from hil.cli import common
from hil.cli.coach_runs import RunsWanted
from hil.cli.tournament_words import entrant_of
from hil.sumo.controllers import BUILT_IN
from hil.sumo.ring import OPPONENTS
from hil.sumo.rivals.rivals import SELF, Rivals
from hil.sumo.tournament.duels import duel_url


def opponent_named(text: str | None) -> tuple[str | None, Rivals | None]:
    """Who is meant.

    Args:
        text: A dummy, or entrants of a tournament and `self`, separated by commas; None: nobody was named.

    Returns:
        What the opponent is called, and the robots that are met; None for a dummy, or where nobody was named.

    Raises:
        UsageError: There is no such opponent, or they do not go together.
        HilError: What an entrant plays by can't be read.
    """
    if text is None or text in OPPONENTS:
        return text, None
    named = [one.strip() for one in text.split(",")]
    if dummy := next((one for one in named if one in OPPONENTS), None):
        raise common.UsageError(f"{dummy} is an opponent of its own, and no robot that others take turns with: leave it out")
    try:
        entrants = tuple(entrant_of(one) for one in named if one != SELF)
        rivals = Rivals(entrants, self_play=SELF in named)
    except ValueError as error:
        if len(named) > 1 or "there is no entrant" not in str(error):
            raise common.UsageError(f"--opponent {text}: {error}") from error
        known = (*OPPONENTS, *BUILT_IN, SELF)
        raise common.UsageError(
            f"there is no opponent {text!r}: choose one of {', '.join(OPPONENTS)}; or a robot: {', '.join(BUILT_IN)}, {SELF}, "
            f"a file of advice or policy, a run's folder{did_you_mean(text, known)}"
        ) from error
    return rivals.name, rivals


def run_against_robots(runs: int | None) -> RunsWanted:
    """How many runs there are against robots: one.

    Args:
        runs: How many were asked for; None: nobody has said.

    Raises:
        UsageError: Several were asked for.
    """
    if runs is not None and runs > 1:
        raise common.UsageError(f"against robots it is one run: leave out --runs, or name a dummy ({', '.join(OPPONENTS)})")
    return RunsWanted(1, "" if runs else "it meets robots")


def ring_url(link: str | None, seed: int) -> str:
    """Address of the ring in which two robots meet.

    Args:
        link: As given; None is a ring in this process.
        seed: Its seed.

    Raises:
        UsageError: Nobody can play the other robot there.
    """
    if link is None:
        return duel_url(seed)
    address = parse_address(link)
    if address.scheme != "sim" or "opponent" in address.options:
        raise common.UsageError(
            f"both robots have to be emulated in this process, and {link} is something else: leave LINK out "
            "(a rehearsal of a bad line is sim://junior?faults=...)"
        )
    return link if "networks" in address.options else f"{link}{'&' if address.options else '?'}networks=2"
