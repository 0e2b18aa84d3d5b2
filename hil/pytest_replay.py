"""Replays of logs as tests: the fixture `hil_replay`, and one test of each log at `--hil-replay PATTERN`.

Like `hil.pytest_plugin`, which loads it, this module is loaded in every run of pytest: what takes time to load waits for the
first replay.
"""

from __future__ import annotations

from glob import glob
from pathlib import Path
from typing import TYPE_CHECKING, Final, Protocol

import pytest

from hil.pytest_logs import keep_replayed

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hil.replaying.host import ReplayReport


class HilReplay(Protocol):
    """What the fixture `hil_replay` gives."""

    def __call__(self, log: Path | str, *, strict: bool = False, signing_key: Path | str | None = None) -> ReplayReport:
        """Replay a log; see the fixture."""
        ...


LOGS: Final = pytest.StashKey[frozenset[Path]]()
"""The logs at `--hil-replay`, resolved."""
MISSING: Final = pytest.StashKey[set[Path]]()
"""Those of them that are to be collected, and have not been."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option `--hil-replay`."""
    parser.getgroup("junior-hil", "robots (junior-hil)").addoption(
        "--hil-replay",
        metavar="PATTERN",
        action="append",
        default=[],
        help="make a test of each log that matches, as 'tests/logs/*.mcap': it is replayed, and must decide as it did when it "
        "was recorded; may be given several times",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Find the logs, and have pytest collect them beside whatever else it was asked for.

    Raises:
        UsageError: A pattern matches no file.
    """
    folder = config.invocation_params.dir
    found = [log for pattern in config.getoption("--hil-replay") for log in _matching(pattern, folder)]
    logs = config.stash[LOGS] = frozenset(log.resolve() for log in found)
    named = {(folder / argument.partition("::")[0]).resolve() for argument in config.args}
    config.stash[MISSING] = set(logs & named or logs)  # who names logs one by one wants no others
    for log in sorted(config.stash[MISSING] - named):
        if not named.intersection(log.parents):  # else pytest comes by; pytest 8 takes no file and its folder together
            config.args.append(str(log))


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> LogCollector | None:
    """Collect a log that was asked for."""
    path = file_path.resolve()
    if path not in parent.config.stash[LOGS]:
        return None
    parent.config.stash[MISSING].discard(path)
    log: LogCollector = LogCollector.from_parent(parent, path=file_path)
    return log


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config) -> None:
    """See that no log was passed over.

    Raises:
        UsageError: One was.
    """
    missing = config.stash[MISSING]
    if missing:
        text = f"--hil-replay: pytest passes over {min(missing)}, by norecursedirs, --ignore or the like: name its folder too"
        raise pytest.UsageError(text)


class LogCollector(pytest.File):
    """A log."""

    def collect(self) -> Iterable[ReplayItem]:
        """Its one test."""
        yield ReplayItem.from_parent(self, name="replay")


class ReplayItem(pytest.Item):
    """The test of a log: today's program decides on its input as was decided then."""

    def runtest(self) -> None:
        """Replay the log."""
        _replayed(self, self.path, key=self.config.getoption("--hil-signing-key"))

    def reportinfo(self) -> tuple[Path, None, str]:
        """Where it is, and what it is called."""
        return self.path, None, f"replay of {_shown(self.path, self.config)}"


@pytest.fixture
def hil_replay(request: pytest.FixtureRequest) -> HilReplay:
    """Replays a log; the test fails with the first decision that is not as recorded, or with why it can't be replayed.

    `hil_replay(log, strict=False, signing_key=None)` returns a `hil.ReplayReport`. A relative path is one of the folder that
    pytest was started in, or of pytest's root folder. `strict` compares every entry; `signing_key` is the key file of a run
    whose frames were signed, by default that of `--hil-signing-key`.
    """
    config = request.config

    def replayed(log: Path | str, *, strict: bool = False, signing_key: Path | str | None = None) -> ReplayReport:
        folders = config.invocation_params.dir, config.rootpath
        path = next((found for folder in folders if (found := folder / log).exists()), None)
        if path is None:
            pytest.fail(f"there is no log {log}, seen from {' or '.join(map(str, dict.fromkeys(folders)))}", pytrace=False)
        key = signing_key or config.getoption("--hil-signing-key")
        return _replayed(request.node, path, strict=strict, key=key)

    return replayed


def _replayed(item: pytest.Item, log: Path, *, strict: bool = False, key: Path | str | None = None) -> ReplayReport:
    """Replay a log; fail the running test at the first difference, or with why it can't be replayed."""
    from firmware_protocol.errors import HilError  # noqa: PLC0415 - all of this takes a moment to load
    from hil.replaying.host import replay  # noqa: PLC0415
    from hil.signing.key_file import load_key  # noqa: PLC0415

    shown = _shown(log, item.config)
    try:
        report = replay(log, strict=strict, signing_key=None if key is None else load_key(Path(key)))
    except HilError as error:
        text = f"{str(error).replace(str(log), shown)}\nThe log can't be replayed, so this says nothing of the program."
    else:
        if report.same:
            return report
        assert report.difference is not None
        told = str(report).partition("\n")[2].replace(str(report.path), shown)
        again = f"To see it again: hil replay {shown}{' --strict' if strict else ''}"
        text = f"{report.difference.head_of(shown)}\n{told}\n{again}"
    keep_replayed(item, log, shown)
    pytest.fail(text, pytrace=False)


def _shown(log: Path, config: pytest.Config) -> str:
    """The path of a log as a person would type it, from the folder that pytest was started in."""
    folder = config.invocation_params.dir
    return str(log.relative_to(folder) if log.is_relative_to(folder) else log)


def _matching(pattern: str, folder: Path) -> list[Path]:
    """The files that a pattern matches, sorted."""
    names = sorted(glob(pattern, root_dir=folder, recursive=True))  # noqa: PTH207 - Path.glob takes no absolute pattern
    found = [path for name in names if (path := folder / name).is_file()]
    if not found:
        hint = f"; it is a folder: name its logs, '{pattern.rstrip('/')}/*.mcap'" if (folder / pattern).is_dir() else ""
        raise pytest.UsageError(f"--hil-replay {pattern}: no file matches this, seen from {folder}{hint}")
    return found
