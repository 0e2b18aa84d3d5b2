"""Logs of failing tests: with `--hil-logs DIR`, a test that used a robot and failed leaves its log, a page and pictures there.

    DIR/tests-test_program.py-test_it_turns/
        log.mcap        what passed between program and robot
        view.html       a page that plays it, and needs no other file; where there is nothing to play, there is the report alone
        report.html     its report, which needs no other file
        sensors.png     pictures, where matplotlib is installed

The failure's section in pytest's output names them. Tests that pass leave nothing. Like `hil.pytest_plugin`, which loads it,
this module is loaded in every run of pytest: what takes time to load waits for the first log.
"""

from __future__ import annotations

import contextlib
import re
import shutil
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Mapping

    from hil.recording.recorder import Recorder

LOG: Final = "log.mcap"
VIEW: Final = "view.html"
SECTION: Final = "robot's log (closed at teardown)"
"""Title of what is said of the logs: pytest shows such a section of a test's end with its failure, if `teardown` is in it."""
PICTURES: Final = ("bouts", "sensors")
"""Of the pictures, that one is named which shows most: the first of these that there is."""
_LONGEST: Final = 120
"""Characters that a folder's name has at most."""


@dataclass
class KeptLog:
    """A log that is kept if what it is of fails.

    Attributes:
        title: What it is of: a fixture.
        log: The log.
        shown: Its folder, as a person would type it.
        recorder: Writes it; None where the log is there already.
        ending: Is called before the log is closed.
        begun: When what it is told of began, in s of its time.
    """

    title: str
    log: Path
    shown: Path
    recorder: Recorder | None = None
    ending: list[Callable[[], None]] = field(default_factory=list)
    begun: float = 0.0

    @property
    def told(self) -> str:
        """Where it is, in words."""
        return f"{self.title}: {self.shown / self.log.name}"

    def keep(self) -> str:
        """Close it, and make the page.

        Returns:
            What there is now, in words.
        """
        try:
            self._end()
            if self.recorder is not None:
                self.recorder.close()
            page, pictures = _page(self.log)
        except Exception as error:  # noqa: BLE001 - whatever is wrong with a page, the tests go on
            return f"{self.told}\nThere is no page of it: {error}"
        told = [self.told, f"page: {self.shown / page.name}"]
        by_name = {picture.stem: picture for picture in pictures}
        named = next((by_name[name] for name in PICTURES if name in by_name), None)
        told.append(f"picture: {self.shown / named.name}" if named else _without_pictures())
        return "\n".join(told)

    def drop(self) -> None:
        """Leave nothing of it."""
        if self.recorder is not None:
            self._end()
            self.recorder.discard()
        with contextlib.suppress(OSError):
            self.log.parent.rmdir()

    def _end(self) -> None:
        for end in self.ending:
            end()
        self.ending.clear()


KEPT: Final = pytest.StashKey[list[KeptLog]]()
"""Of a test: the logs of its robots. Of the whole run: that of the robot at `--hil-link`, if one is connected."""
AT_LINK: Final = pytest.StashKey[bool]()
"""A test uses the robot at `--hil-link`."""
FAILED: Final = pytest.StashKey[bool]()
"""A test, or one of the run, has failed."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option `--hil-logs`."""
    parser.getgroup("junior-hil", "robots (junior-hil)").addoption(
        "--hil-logs",
        metavar="DIR",
        help="keep the log of every failing test that used a robot, a page and pictures of it, in folders of this one",
    )


def pytest_configure(config: pytest.Config) -> None:
    """See that there can be such a folder.

    Raises:
        UsageError: It is none.
    """
    config.stash[KEPT], config.stash[FAILED] = [], False
    folder = _folder(config)
    if folder is not None and folder.exists() and not folder.is_dir():
        text = f"--hil-logs {config.getoption('--hil-logs')}: this is no folder: name one, which need not exist"
        raise pytest.UsageError(text)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """When a test is over, keep its logs or drop them, and say so."""
    report = yield
    logs = item.stash.get(KEPT, [])
    of_run = item.config.stash[KEPT] if item.stash.get(AT_LINK, False) else []
    if report.failed:
        item.stash[FAILED] = True
        if report.when == "setup" and logs:  # of an error in the setup pytest does not show what is said at the teardown
            report.sections.append(("robot's log", "\n".join(log.told for log in logs)))
    if report.when == "teardown":
        if item.stash.get(FAILED, False):
            told = [log.keep() for log in logs]
            told += [_told_of_run(log, item.config) for log in of_run]
            if told:
                report.sections.append((SECTION, "\n".join(told)))
        else:
            for log in logs:
                log.drop()
        item.stash[KEPT], item.stash[FAILED] = [], False  # a plugin may have it run again
    return report


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Keep or drop the log of the robot at `--hil-link`, and leave no empty folder."""
    config = session.config
    for log in config.stash[KEPT]:
        if config.stash[FAILED]:
            log.keep()
        else:
            log.drop()
    config.stash[KEPT] = []
    folder = _folder(config)
    if folder is not None:
        with contextlib.suppress(OSError):
            folder.rmdir()


def begin_test_log(
    request: pytest.FixtureRequest, title: str, link: str, config: Mapping[str, str], *, lockstep: bool
) -> KeptLog | None:
    """Begin the log of a test's robot; None where none is asked for.

    Args:
        request: Of the fixture.
        title: Name of the fixture.
        link: Address of the robot.
        config: What the log says of what the test wants.
        lockstep: Time passes only while the test waits for the robot.

    Raises:
        LogError: It can't be written.
    """
    kept = _begin(request.config, request.node.nodeid, title, link, config, lockstep=lockstep)
    if kept is not None:
        request.node.stash.setdefault(KEPT, []).append(kept)
    return kept


def begin_link_log(config: pytest.Config, link: str) -> KeptLog | None:
    """Begin the log of the robot at `--hil-link`, which is one for the whole run; None where none is asked for.

    Args:
        config: Of the run.
        link: Address of the robot.

    Raises:
        LogError: It can't be written.
    """
    kept = _begin(config, "robot-at-link", "junior", link, {}, lockstep=False)
    if kept is not None:
        config.stash[KEPT].append(kept)
    return kept


def note_test(item: pytest.Item) -> None:
    """Note in the log of the robot at `--hil-link` that a test begins.

    Args:
        item: The test.
    """
    item.stash[AT_LINK] = True
    for log in item.config.stash[KEPT]:
        if log.recorder is not None:
            log.begun = log.recorder.now
            log.recorder.note("test", item.nodeid)


def keep_replayed(item: pytest.Item, log: Path, shown: str) -> None:
    """Keep a copy of a log that could not be replayed as it was recorded, with a page, where logs are kept.

    Args:
        item: The test.
        log: The log.
        shown: Its path, as a person would type it.
    """
    folder = _new_folder(item.config, item.nodeid)
    if folder is not None:
        copy = folder / log.name
        shutil.copyfile(log, copy)
        item.stash.setdefault(KEPT, []).append(KeptLog(f"copy of {shown}", copy, _shown(folder, item.config)))


def _begin(
    config: pytest.Config, name: str, title: str, link: str, wanted: Mapping[str, str], *, lockstep: bool
) -> KeptLog | None:
    folder = _new_folder(config, name)
    if folder is None:
        return None
    from hil.recording.process import begin_log  # noqa: PLC0415 - all of this takes a moment to load
    from hil.versions import versions  # noqa: PLC0415

    of_program = versions()
    about = {"version": of_program["junior-hil"], "protocol": of_program["protocol"], "link": link, "test": name, **wanted}
    recorder = begin_log(
        folder / LOG,
        run={"started": datetime.now(UTC).isoformat(timespec="seconds"), "command": f"pytest {name}"},
        config=about,
        link=link,
        lockstep=lockstep,
        beside=title == "junior" and not lockstep,
    )
    return KeptLog(title, folder / LOG, _shown(folder, config), recorder)


def _page(log: Path) -> tuple[Path, tuple[Path, ...]]:
    """Make the page that plays a log, its report and its pictures, beside it.

    Returns:
        The page, which is the report's where there is nothing to play; and the pictures.

    Raises:
        LogError: It can't be read, or nothing can be written there.
    """
    from hil.look.writing import write_view  # noqa: PLC0415 - all of this takes a moment to load
    from hil.mcaplog.errors import UnreadableLogError  # noqa: PLC0415
    from hil.report import write_report  # noqa: PLC0415

    report = write_report(log, log.parent, png=True)
    try:
        page, _ = write_view(log, log.with_name(VIEW))
    except UnreadableLogError:
        return report.page, report.pictures
    return page, report.pictures


def _without_pictures() -> str:
    """Why there are no pictures, in words."""
    from hil.report.style import INSTALL, can_draw  # noqa: PLC0415

    return "There is nothing to draw in it." if can_draw() else f"There are no pictures: {INSTALL} adds them."


def _told_of_run(log: KeptLog, config: pytest.Config) -> str:
    """Where the log of the robot at `--hil-link` is, and which part of it is this test's, in words."""
    config.stash[FAILED] = True
    until = log.begun if log.recorder is None else log.recorder.now
    return f"{log.told}, from {log.begun:.3f} s to {until:.3f} s; a page of it is made when the last test is over"


def _folder(config: pytest.Config) -> Path | None:
    """Where logs are kept; None: nowhere."""
    name = config.getoption("--hil-logs")
    return config.invocation_params.dir / name if name else None


def _new_folder(config: pytest.Config, name: str) -> Path | None:
    """A folder that is there for this alone; what another run, or another process of this run, has left is not touched."""
    kept = _folder(config)
    if kept is None:
        return None
    kept.mkdir(parents=True, exist_ok=True)
    plain = re.sub(r"[^\w.]+", "-", name).strip("-.")[-_LONGEST:]
    number = 1
    while True:
        folder = kept / (plain if number == 1 else f"{plain}-{number}")
        try:
            folder.mkdir()
        except FileExistsError:
            number += 1
        else:
            return folder


def _shown(path: Path, config: pytest.Config) -> Path:
    """A path as a person would type it, from the folder that pytest was started in."""
    folder = config.invocation_params.dir
    return path.relative_to(folder) if path.is_relative_to(folder) else path
