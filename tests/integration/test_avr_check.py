"""The conformance suite on the ATmega328P: it passes, and finds in the ELF what it finds in the host build."""

from __future__ import annotations

import functools
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from itertools import count
from typing import TYPE_CHECKING, Final

import pytest
from mutants import MUTANTS, Mutant

from firmware_protocol.links.memory import MemoryLink
from firmware_protocol.roles.junior import JUNIOR
from firmware_protocol.wire.fields import MAVLINK
from hil.cli.app import run
from hil.conformance import CHECKS, LAST, CheckOutcome, Subject, for_role, on_wire, perform
from simdevice.avr.board import AvrBoard
from simdevice.avr.build import FIRMWARE, AvrFirmware, build
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from pathlib import Path

    from hil.conformance import Check, Verdict

pytestmark = [pytest.mark.avr, pytest.mark.slow]

TRIED: Final = (
    "bad-checksum-dropped",
    "all-means-stop-only",
    "sensors-50-hz",
    "parameters-refuse-nan",
    "same-sequence-performs-once",
    "new-session-disarms",
    "memory-checksum",
    "memory-survives-reboot",
    "contest-countdown",
    "actions-turn-wheels",
)
"""One or two for each source file of the core: each takes a build, and then a second. All are tried on the host build."""

DRIVERS: Final = (
    Mutant(
        "parameters-survive-reboot",
        "never writes its EEPROM once it runs",
        "../targets/avr/eeprom.c",
        "        waiting = false;\n        write(waiting_address, waiting_value);",
        "        waiting = false;",
    ),
    Mutant(
        "parameters-survive-reboot",
        "resets in the midst of a byte that waits to be written",
        "../targets/avr/main.c",
        "    eeprom_finish();",
        "",
    ),
)


@dataclass(frozen=True)
class Workshop:
    """Builds broken firmwares from the real one's objects.

    Attributes:
        folder: Where to.
    """

    folder: Path

    def make(self, source: Path, objects: Path) -> AvrFirmware:
        """Compile what has changed."""
        command = ["make", "-C", str(source), "avr", f"BUILD={objects}", f"PYTHON={sys.executable}", "WARNINGS=-std=c99 -w"]
        done = subprocess.run(command, check=False, capture_output=True, text=True, env=os.environ | {"MAKEFLAGS": ""})  # noqa: S603
        assert done.returncode == 0, done.stderr
        return AvrFirmware(objects / "avr" / "junior.elf", build().shim)

    def sources(self, name: str) -> Path:
        """A copy of the sources, as old as they are."""
        source = self.folder / name / "firmware"
        shutil.copytree(FIRMWARE, source, ignore=shutil.ignore_patterns("_build", "*.so", "__pycache__"))
        shutil.copytree(FIRMWARE.parent / "dialect", source.parent / "dialect")
        return source

    def mutant(self, mutant: Mutant) -> AvrFirmware:
        """The firmware with one thing changed."""
        original = self.folder / "original" / "objects"
        if not original.exists():
            self.make(self.sources("original"), original)
        name = re.sub(r"\W", "-", mutant.fault)
        source = self.sources(name)
        mutant.path(source).write_text(mutant.text(), encoding="utf-8")
        objects = self.folder / name / "objects"
        shutil.copytree(original, objects)
        return self.make(source, objects)


@pytest.fixture(scope="module")
def workshop(tmp_path_factory: pytest.TempPathFactory) -> Workshop:
    return Workshop(tmp_path_factory.mktemp("avr-mutants"))


def subject(firmware: AvrFirmware | None = None) -> Subject:
    world = junior_world(WorldSettings(board=functools.partial(AvrBoard, firmware=firmware)))
    numbers = count(4711)
    return Subject(MemoryLink(world), world, session=lambda: next(numbers))


def with_needs(name: str) -> list[Check]:
    """A check, and those that it rests on."""
    wanted = {name}
    for check in reversed(CHECKS):
        if check.name in wanted:
            wanted.update(check.needs)
    return [check for check in CHECKS if check.name in wanted]


def failed(verdicts: list[Verdict]) -> list[str]:
    return [verdict.check.name for verdict in verdicts if verdict.outcome is CheckOutcome.FAILED]


def test_the_elf_passes_every_check() -> None:
    robot = subject()
    robot.greet()
    checks = [check for check in for_role(on_wire(CHECKS, MAVLINK), JUNIOR) if not check.keyed]
    verdicts = perform(robot, checks, LAST, moving=True)
    assert [(verdict.check.name, verdict.detail) for verdict in verdicts if verdict.outcome is not CheckOutcome.PASSED] == []


def test_the_command_checks_the_board_by_its_address(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", "sim://junior?board=avr&referee=0", "--only", "watchdog-stops", "--quiet"]) == 0
    assert capsys.readouterr().out == "2 passed\n"


@pytest.mark.parametrize(
    "mutant",
    [*(mutant for mutant in MUTANTS if mutant.caught_by in TRIED), *DRIVERS],
    ids=lambda mutant: mutant.fault.replace(" ", "-")[:40],
)
def test_a_broken_elf_fails_the_check_that_names_its_fault(mutant: Mutant, workshop: Workshop) -> None:
    robot = subject(workshop.mutant(mutant))
    robot.greet()
    assert mutant.caught_by in failed(perform(robot, with_needs(mutant.caught_by), LAST, moving=True)), f"it {mutant.fault}"
