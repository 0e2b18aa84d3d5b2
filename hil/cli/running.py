"""A run from the command line: where it leaves what, checked before anything is made, and how it ended."""

from __future__ import annotations

import os
import platform
import shlex
import sys
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from firmware_protocol.address import parse_address
from hil import runs
from hil.cli import common
from hil.connecting.connecting import fault_option
from hil.files.outputs import check_distinct, check_output
from hil.jobs.session import WITHOUT_A_WORD
from hil.processes import process_identity
from hil.signing.key_file import load_key
from hil.versions import versions

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from hil.runs import Run

FAILED = "failed"
STATES = {common.EXIT_DONE: runs.DONE, common.EXIT_FELL_SHORT: runs.FELL_SHORT}
"""How a run that came to its end stands, by its exit status; `failed` for any other."""


class ActiveRun:
    """A run that is on.

    Attributes:
        run: Its folder; None where nothing would be in it.
        log: Where its log goes, or what there is of one that could not be finished; None for none.
        overwrite: Named outputs that exist may be replaced.
        failures: What could not be written, in words.
    """

    def __init__(self, run: Run | None, log: Path | None, *, overwrite: bool) -> None:
        self.run = run
        self.log = log
        self.overwrite = overwrite
        self.failures: list[str] = []
        self._status: int | None = None

    @property
    def folder(self) -> str | None:
        """Its folder, for JSON."""
        return None if self.run is None else str(self.run.folder)

    @property
    def log_file(self) -> str | None:
        """Its log, for JSON."""
        return None if self.log is None else str(self.log)

    def place(self, named: Path | None, name: str) -> Path:
        """Where an output goes: where it was asked for, or into the folder.

        Args:
            named: What was asked for.
            name: Its name in the folder.
        """
        if named is not None:
            return named
        assert self.run is not None, "a run that makes files has a folder for those that are not named"
        return self.run.folder / name

    def describe(self, **values: Any) -> None:  # noqa: ANN401 - fields of the record
        """Say more of the run in its record: what only became known by connecting.

        Args:
            **values: Fields of `hil.runs.RunRecord`.
        """
        if self.run is None:
            return
        for name, value in values.items():
            setattr(self.run.record, name, value)
        self._save()

    def finish(self, result: Mapping[str, object], status: int = common.EXIT_DONE) -> None:
        """It has come to its end.

        Args:
            result: What came of it.
            status: Exit status.
        """
        self._status = status
        if self.run is not None:
            self.run.record.result = dict(result)

    @property
    def status(self) -> int:
        """The exit status: that of the run itself, unless it is done and an output that was asked for is not whole."""
        status = common.EXIT_DONE if self._status is None else self._status
        return common.EXIT_FILE if self.failures and status == common.EXIT_DONE else status

    def ended(self) -> int:
        """Say once more what could not be written; the exit status."""
        for text in self.failures:
            common.complain(text)
        return self.status

    def failed(self, text: str) -> None:
        """Something that was asked for can't be written: told at once, and at the end.

        Args:
            text: What, in words.
        """
        self.failures.append(text)
        common.complain(text)

    def log_failed(self, text: str, kept: Path | None) -> None:
        """The log can't be written any further: from now on the run's log is what there is of it.

        Args:
            text: What, in words.
            kept: The file that holds what there is of it; None where none does.
        """
        self.log = kept
        self.failed(text)

    def end(self, error: BaseException | None) -> None:
        """Write down how it ended, and remove what is left of one in which nothing was said.

        Args:
            error: What ended it; None where nothing did.
        """
        if isinstance(error, WITHOUT_A_WORD) and self._status is None:
            if self.run is not None:
                self.run.remove()
            return
        if self.run is None:
            return
        self._settle(self.run.record, error)
        self.run.record.ended = _now().isoformat(timespec="milliseconds")
        if not self._save():
            self._settle(self.run.record, error)
            self._save_in_place()

    @contextmanager
    def telling(self) -> Iterator[None]:
        """What came of it is told, after its end: where that fails, so has the run."""
        try:
            yield
        except (OSError, SystemExit) as error:
            self.end(error)
            raise

    def _settle(self, record: runs.RunRecord, error: BaseException | None) -> None:
        """Say in the record how it ended."""
        if error is None:
            record.status = self.status
            record.state = STATES.get(record.status, FAILED)
        else:
            record.state = "interrupted" if isinstance(error, KeyboardInterrupt) else FAILED
            record.status = common.EXIT_INTERRUPTED if isinstance(error, KeyboardInterrupt) else common.status_of(error)
        record.error = "; ".join(filter(None, [common.in_words(error) if error else "", *self.failures]))

    def _save(self) -> bool:
        assert self.run is not None
        try:
            self.run.save()
        except OSError as error:
            text = f"{self.run.folder / runs.RECORD} cannot be written anew: {error.strerror}"
            if text not in self.failures:
                self.failed(text)
            return False
        return True

    def _save_in_place(self) -> None:
        """Say at least how it ended where a full disk has no room for a new record beside the old one."""
        assert self.run is not None
        for result in (self.run.record.result, {}):
            self.run.record.result = result
            with suppress(OSError):
                self.run.save_in_place()
                return


@contextmanager
def running(
    verb: str,
    what: str,
    *,
    url: str,
    emulated_here: bool = False,
    opponent: str = "",
    seed: int = 0,
    signing_key: Path | None = None,
    out: Path | None = None,
    log: Path | None = None,
    no_log: bool = False,
    overwrite: bool = False,
    makes: Mapping[str, Path | None] | None = None,
    kept: tuple[Path, ...] = (),
) -> Iterator[ActiveRun]:
    """A run: everything is checked, then its folder is made, and at the end it says how it went.

    Args:
        verb: Name of the sub-command.
        what: Against or with what, for the folder's name.
        url: Address of the robot.
        emulated_here: The robot is one of this process.
        opponent: Opponent.
        seed: Seed.
        signing_key: Key file.
        out: The run's folder; None makes one below `runs`.
        log: Where the log goes; None is the folder.
        no_log: No log is wanted.
        overwrite: Named outputs that exist may be replaced.
        makes: What else it makes: name in the folder, and where it goes instead of there.
        kept: Named outputs that are meant to be there already, and are kept up to date.

    Yields:
        The run.

    Raises:
        AddressError, KeyFileError: The address, or the key file, can't be used.
        OutputError: A named output can't be written.
        RunError: The folder is there already, or can't be made.
        UsageError: Options exclude each other.
    """
    makes = makes or {}
    fault_option(parse_address(url))
    if signing_key is not None:
        load_key(signing_key)
    if no_log and log is not None:
        raise common.UsageError("--log and --no-log exclude each other")
    named = [path for path in (log, *makes.values()) if path is not None]
    check_distinct(*named)
    for path in named:
        check_output(path, overwrite=overwrite or path in kept)
    inside = (log is None and not no_log) or any(path is None for path in makes.values())
    if out is not None and not inside:
        raise common.UsageError("--out names a folder in which nothing would be: everything goes elsewhere")
    run = None
    if inside:
        now = _now()
        record = runs.RunRecord(
            verb,
            what,
            now.isoformat(timespec="milliseconds"),
            pid=os.getpid(),
            process=process_identity(os.getpid()),
            host=platform.node(),
            command=shlex.join(["hil", *sys.argv[1:]]),
            link="" if emulated_here else url,
            opponent=opponent,
            seed=seed,
            settings=_options(),
            versions=versions(),
        )
        run = runs.make_run(record, now, out=out)
        if log is None and not no_log:
            log = run.log
    active = ActiveRun(run, log, overwrite=overwrite)
    try:
        yield active
    except BaseException as error:
        active.end(error)
        raise
    active.end(None)


def _options() -> dict[str, Any]:
    """Every option of the sub-command as it was resolved."""
    given = common.OPTIONS.get()
    return {
        name: str(value) if isinstance(value, Path) else value
        for name, value in given.items()
        if value is None or isinstance(value, str | int | float | Path | list)
    }


def _now() -> datetime:
    return datetime.now(UTC).astimezone()
