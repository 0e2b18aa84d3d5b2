"""One folder a run: made exclusively, with what the run was, what it made, and how it ended.

    runs/20261128-130501-coach-flat-light/
        run.json         what was run, with which versions, of what robot; "running", and then how it ended
        log.mcap         everything that happened; of bouts played side by side, bouts-01-10.mcap and so on instead
        advice.toml      what was learnt; where the advice stays that it began from, that, and beside it learnt-advice.toml
        given.toml       the advice that several coachings, put together, began from
        tables.toml      what a swarm has learnt; of several seeds tables-1.toml and so on instead
        checkpoint.json  what a run that was cut goes on from
        team.json        that several coachings belong together: run-1.json, run-1.mcap and so on are checkpoint and log of each
        report/          pages and pictures
        view.html        a page that plays the log
        tournament.svg   the picture of a tournament, whose upsets are in upset-1-WINNER-LOSER.mcap and so on

A folder that exists is never written into, and only what a run has made is ever removed.
"""

from __future__ import annotations

import contextlib
import os
import platform
import re
import shutil
from dataclasses import asdict, dataclass, field, fields
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.errors import HilError
from hil.doors import Door
from hil.files.json_text import json_text
from hil.files.outputs import overwrite_file, replace_file
from hil.processes import is_running

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

RUNS: Final = Path("runs")
"""Where runs are, by default."""
RECORD: Final = "run.json"
LOG: Final = "log.mcap"
PART_LOGS: Final = "bouts-*.mcap"
"""Logs of bouts that were played side by side."""
UPSET_LOGS: Final = "upset-*.mcap"
"""Logs of bouts of a tournament that the weaker won."""
TOURNAMENT_PICTURE: Final = "tournament.svg"
TOURNAMENT_PIXELS: Final = "tournament.png"
SEED_TABLES: Final = "tables-*.toml"
"""What a swarm has learnt with each of several seeds."""
ADVICE: Final = "advice.toml"
LEARNT: Final = "learnt-advice.toml"
"""What was learnt where the advice stays that a coaching began from."""
GIVEN: Final = "given.toml"
"""The advice that coachings of several robots began from; one coaching's is in its checkpoint."""
TABLES: Final = "tables.toml"
CHECKPOINT: Final = "checkpoint.json"
TEAM: Final = "team.json"
TEAM_FILES: Final = ("run-[1-9]*.json", "run-[1-9]*.mcap", "run-[1-9]*.slim")
"""Checkpoints and logs of several coachings that belong together, and logs that were being made small."""
REPORT: Final = "report"
VIEW: Final = "view.html"
VERSION: Final = 1
RUNNING: Final = "running"
DONE: Final = "done"
FELL_SHORT: Final = "fell short"


class RunError(HilError):
    """A run can't be found, or its folder can't be made; the text says which, and what to do."""


DOOR: Final = Door("record of a run", RunError, largest=1 << 20)


@dataclass
class RunRecord:
    """What `run.json` says.

    Attributes:
        verb: What was run: `coach`, `bout`, ...
        what: Against or with what: an opponent, `robot`, ...
        started: When, ISO 8601 with the time zone.
        state: `running`; or how it ended: `done`, `fell short`, `failed`, `interrupted`.
        pid: Process that runs it.
        process: Which process of this id it is: when the computer and it were started; empty where that can't be told.
        host: Name of the computer that the process is on.
        command: The command line.
        link: Address of the robot; empty for one emulated in the process.
        opponent: Opponent; empty where there is none.
        robot: Unique id of the robot, 16 hexadecimal digits; empty where it is not known, or emulated.
        seed: Seed of every random choice.
        settings: Every resolved option.
        versions: Of this program, its protocol, and what it computes with.
        resumed_from: Checkpoint that it went on from; empty where it began anew.
        ended: When, like `started`.
        status: Exit status.
        error: What ended it, in words; empty where nothing did.
        result: What came of it.
        version: Version of this record's form.
    """

    verb: str
    what: str
    started: str
    state: str = RUNNING
    pid: int = 0
    process: str = ""
    host: str = ""
    command: str = ""
    link: str = ""
    opponent: str = ""
    robot: str = ""
    seed: int = 0
    settings: dict[str, Any] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)
    resumed_from: str = ""
    ended: str = ""
    status: int | None = None
    error: str = ""
    result: dict[str, Any] = field(default_factory=dict)
    version: int = VERSION


@dataclass(frozen=True)
class Run:
    """A run's folder.

    Attributes:
        folder: The folder.
        record: What it says of itself.
    """

    folder: Path
    record: RunRecord

    @property
    def log(self) -> Path:
        """Its log."""
        return self.folder / LOG

    @property
    def advice(self) -> Path:
        """Its advice."""
        return self.folder / ADVICE

    @property
    def checkpoint(self) -> Path:
        """Its checkpoint."""
        return self.folder / CHECKPOINT

    @property
    def saved_to(self) -> Path:
        """Its checkpoint, also where it was asked for elsewhere."""
        named = self.record.settings.get("checkpoint")
        return Path(named) if isinstance(named, str) and named else self.checkpoint

    @property
    def team(self) -> Path | None:
        """What says which coachings belong together; None where it is one."""
        path = self.folder / TEAM
        return path if path.is_file() else None

    @property
    def source(self) -> Path | None:
        """The checkpoint that it went on from; None where it began anew."""
        return Path(self.record.resumed_from) if self.record.resumed_from else None

    @property
    def report(self) -> Path:
        """Folder of its report."""
        return self.folder / REPORT

    @property
    def state(self) -> str:
        """How it stands: as recorded, or `killed` where it says that it is running and its process is gone."""
        record = self.record
        if record.state == RUNNING and record.host in {"", platform.node()}:
            return RUNNING if is_running(record.pid, record.process) else "killed"
        return record.state

    @property
    def size(self) -> int:
        """Bytes of all that is in it."""
        size = 0
        for folder, _, names in os.walk(self.folder):
            for name in names:
                with contextlib.suppress(OSError):  # what a run that goes on has just removed is of no size
                    size += os.lstat(Path(folder) / name).st_size
        return size

    def save(self) -> None:
        """Write `run.json` anew.

        Raises:
            OSError: The disk does not take it; the old one is as it was.
        """
        replace_file(self.folder / RECORD, self._text())

    def save_in_place(self) -> None:
        """Write `run.json` into the room that it has on the disk, where there is none for a second one.

        Raises:
            OSError: It does not fit; the old one is as it was, but for blanks at its end.
        """
        overwrite_file(self.folder / RECORD, self._text())

    def _text(self) -> bytes:
        return json_text(asdict(self.record)).encode()

    def remove(self) -> None:
        """Remove what runs make, and the folder where nothing else is in it; likewise `runs`."""
        for name in (LOG, ADVICE, LEARNT, GIVEN, TABLES, CHECKPOINT, TEAM, VIEW, TOURNAMENT_PICTURE, TOURNAMENT_PIXELS):
            (self.folder / name).unlink(missing_ok=True)
        for pattern in (PART_LOGS, UPSET_LOGS, SEED_TABLES, *TEAM_FILES):
            for made in self.folder.glob(pattern):
                made.unlink()
        if self.report.is_dir() and not self.report.is_symlink():
            shutil.rmtree(self.report)
        (self.folder / RECORD).unlink(missing_ok=True)
        with contextlib.suppress(OSError):  # something else is in it
            self.folder.rmdir()
            if self.folder.parent == RUNS:
                RUNS.rmdir()


def make_run(record: RunRecord, when: datetime, *, out: Path | None = None) -> Run:
    """Make a run's folder, which nobody else gets.

    Args:
        record: What it will say of itself.
        when: The time in its name.
        out: The folder; None is a new one below `runs`.

    Raises:
        RunError: It is there already, or can't be made.
    """
    if out is not None:
        try:
            out.parent.mkdir(parents=True, exist_ok=True)
            out.mkdir()
        except FileExistsError as error:
            raise RunError(f"{out} is there already, and a run's folder is its own: choose another name for --out") from error
        except OSError as error:
            raise RunError(f"cannot make the folder {out}: {error.strerror}") from error
        run = Run(out, record)
    else:
        run = Run(_new_folder(f"{when:%Y%m%d-%H%M%S}-{record.verb}-{record.what}"), record)
    try:
        run.save()
    except OSError as error:
        run.remove()
        raise RunError(f"cannot write {run.folder / RECORD}: {error.strerror}") from error
    return run


def _new_folder(name: str) -> Path:
    """A folder of this name, or the first free one with a number behind it."""
    try:
        RUNS.mkdir(parents=True, exist_ok=True)
        number = 1
        while True:
            folder = RUNS / (name if number == 1 else f"{name}-{number}")
            try:
                folder.mkdir()
            except FileExistsError:
                number += 1
            else:
                return folder
    except OSError as error:
        raise RunError(f"cannot make a folder in {RUNS}: {error.strerror}") from error


def load_run(folder: Path) -> Run:
    """Read what a run's folder says.

    Args:
        folder: The folder.

    Raises:
        RunError: It is no run's folder, or its `run.json` can't be read.
    """
    path = folder / RECORD
    if not path.exists():
        raise RunError(f"{folder} is no run's folder: there is no {RECORD} in it")
    data = DOOR.document(path, json=True).data
    if not isinstance(data, dict) or data.get("version") != VERSION:
        raise RunError(f"{path} is no record of a run of version {VERSION}")
    return Run(folder, RunRecord(**_checked(path, data)))


def _checked(path: Path, data: Mapping[str, Any]) -> dict[str, Any]:
    """The fields that a record has, each of its type; what a newer program has added is passed over."""
    example = RunRecord("", "", "")
    values: dict[str, Any] = {}
    for one in fields(RunRecord):
        if one.name not in data:
            if one.name in {"verb", "what", "started"}:
                raise RunError(f"{path} is no record of a run: it has no {one.name}")
            continue
        kind: type | tuple[type, ...] = (int, type(None)) if one.name == "status" else type(getattr(example, one.name))
        value = data[one.name]
        if not isinstance(value, kind) or isinstance(value, bool):
            raise RunError(f"{path} is no record of a run: {one.name} is {value!r:.40}")
        values[one.name] = value
    try:
        _when(values["started"])
    except (ValueError, OverflowError, OSError) as error:
        raise RunError(f"{path} is no record of a run: started is {values['started']!r:.40}") from error
    return values


def _when(text: str) -> datetime:
    return datetime.fromisoformat(text).astimezone()


def all_runs(root: Path = RUNS) -> Iterator[Run]:
    """Every run, the newest first; folders that are none are passed over.

    Args:
        root: Where they are.
    """
    if not root.is_dir():
        return
    found = []
    for folder in root.iterdir():
        try:
            found.append(load_run(folder))
        except RunError:
            continue
    yield from sorted(found, key=_age, reverse=True)


def _age(run: Run) -> tuple[datetime, int, str]:
    """What orders runs: when they began, in whatever time zone; then the number that one of the same second has."""
    number = re.search(r"-(\d+)$", run.folder.name)
    return _when(run.record.started), int(number[1]) if number else 1, run.folder.name


def newest(
    verbs: tuple[str, ...] = (),
    *,
    has: str = RECORD,
    opponent: str | None = None,
    robot: str | None = None,
    root: Path = RUNS,
) -> Run | None:
    """The newest run that fits.

    Args:
        verbs: What was run; empty is anything.
        has: A file that must be in its folder.
        opponent: Against whom; None is anybody.
        robot: Unique id of the robot; None is any.
        root: Where the runs are.
    """
    for run in all_runs(root):
        record = run.record
        if (
            (not verbs or record.verb in verbs)
            and (opponent is None or record.opponent == opponent)
            and (robot is None or record.robot == robot)
            and (run.folder / has).exists()
        ):
            return run
    return None


def file_of(given: Path | None, name: str, *, verbs: tuple[str, ...] = (), opponent: str | None = None) -> Path:
    """A file that a person names, by itself or by its run.

    Args:
        given: A file; a run's folder; None for the newest run that fits.
        name: The file in a run's folder: `LOG`, `ADVICE`, ...
        verbs: What was run, where none is given.
        opponent: Against whom, likewise; None is anybody.

    Returns:
        The file.

    Raises:
        RunError: There is no such file, or no run fits.
    """
    if given is None:
        run = newest(verbs, has=name, opponent=opponent)
        if run is None:
            against = "" if opponent is None else f" against {opponent}"
            which = f"of {' or '.join(f'hil {verb}' for verb in verbs)}{against} " if verbs else ""
            raise RunError(f"there is no run {which}with {name} in {RUNS}: name a run's folder or a file (hil runs lists them)")
        return run.folder / name
    if not given.is_dir():
        return given
    path = given / name
    if not path.exists():
        parts = sorted(given.glob(PART_LOGS)) if name == LOG else []
        if parts:
            raise RunError(f"the bouts of {given} were played side by side, in several logs: name one of them, as {parts[0]}")
        if upsets := sorted(given.glob(UPSET_LOGS)) if name == LOG else []:
            raise RunError(f"{given} is of a tournament, which has a log of each upset: name one of them, as {upsets[0]}")
        among = any(given.glob(f"*/{name}"))
        raise RunError(f"there is no {name} in {given}{': name one of its runs (hil runs lists them)' if among else ''}")
    return path
