"""Options of jobs as a log has them: nothing that a log says is trusted."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Any, Final, TypeVar

from firmware_protocol.errors import HilError
from hil.policies import policy_of, policy_text
from hil.sumo.advice_file import advice_of, advice_text
from hil.sumo.ring import OPPONENTS
from hil.sumo.rivals.rivals import Rivals
from hil.sumo.tournament.entrants import Entrant, EntrantKind
from pal_advisor.fields import Fields

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

E = TypeVar("E", bound=StrEnum)
T = TypeVar("T")

MOST_SEED: Final = 2**32 - 1
DAY: Final = 86400.0
"""In s."""


class JobFileError(HilError):
    """A file that a job needs is not in the log."""


def none_or(options: Fields, name: str, take: Callable[[Fields, str], T]) -> T | None:
    """A field that may be null.

    Args:
        options: The fields.
        name: Which.
        take: Takes it where it is not.
    """
    if options.peek(name) is None:
        options.take(name)
        return None
    return take(options, name)


def opponent_of(options: Fields, name: str) -> str:
    """A field that names an opponent.

    Args:
        options: The fields.
        name: Which.

    Raises:
        FieldError: There is no such opponent.
    """
    found = options.text(name)
    if found not in OPPONENTS:
        raise options.wrong(name, f"expected one of {', '.join(OPPONENTS)}, not {found!r}")
    return found


def wanted_file(files: Mapping[str, bytes], name: str) -> bytes:
    """A file that has to be there.

    Args:
        files: The files.
        name: Which.

    Raises:
        JobFileError: It is not.
    """
    if name not in files:
        raise JobFileError(f"it does not hold {name}, by which it was run")
    return files[name]


def entrant_files(stem: str, entrant: Entrant) -> dict[str, bytes]:
    """The file that an entrant plays by, as a job has it; none where nothing was learnt.

    Args:
        stem: Name of the file, but for its ending.
        entrant: Who plays.
    """
    if entrant.advice is not None:
        return {f"{stem}.toml": advice_text(entrant.advice).encode()}
    return {} if entrant.policy is None else {f"{stem}.json": policy_text(entrant.policy).encode()}


def entrant_from(options: Fields, kind: str, name: str, stem: str, files: Mapping[str, bytes]) -> Entrant:
    """An entrant, as a log has it.

    Args:
        options: The fields.
        kind: Field that says how it plays.
        name: Field that says what it is called.
        stem: As for `entrant_files`.
        files: The files of the job.

    Raises:
        FieldError: A field is missing or wrong.
        HilError: The file is missing or wrong.
    """
    plays, called = options.one_of(kind, EntrantKind), options.text(name)
    advice = advice_of(wanted_file(files, f"{stem}.toml")) if plays.takes == "an advice" else None
    policy = policy_of(wanted_file(files, f"{stem}.json")) if plays is EntrantKind.POLICY else None
    try:
        return Entrant(called, plays, advice, policy)
    except ValueError as error:
        raise options.wrong(name, str(error)) from error


def rivals_options(rivals: Rivals) -> dict[str, Any]:
    """Who is met in a coaching, but for what they play by.

    Args:
        rivals: Who.
    """
    entrants = [{"kind": one.kind.value, "name": one.name} for one in rivals.entrants]
    return {"entrants": entrants, "self_play": rivals.self_play}


def rivals_files(rivals: Rivals) -> dict[str, bytes]:
    """What they play by, `rival-1.toml` and so on.

    Args:
        rivals: Who.
    """
    found: dict[str, bytes] = {}
    for number, entrant in enumerate(rivals.entrants, start=1):
        found |= entrant_files(f"rival-{number}", entrant)
    return found


def rivals_of(options: Fields, name: str, files: Mapping[str, bytes]) -> Rivals:
    """Who is met in a coaching, as a log has it.

    Args:
        options: The fields of the job.
        name: Which of them.
        files: The files of the job.

    Raises:
        FieldError: A field is missing, unknown or wrong.
        HilError: A file is missing or wrong.
    """
    found = Fields(options.take(name), name)
    entrants = []
    for number, (path, one) in enumerate(found.items("entrants"), start=1):
        fields = Fields(one, path)
        entrants.append(entrant_from(fields, "kind", "name", f"rival-{number}", files))
        fields.done()
    self_play = found.flag("self_play")
    found.done()
    try:
        return Rivals(tuple(entrants), self_play=self_play)
    except ValueError as error:
        raise found.wrong("entrants", str(error)) from error
