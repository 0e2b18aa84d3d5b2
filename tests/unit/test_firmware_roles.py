"""The seam between the firmware's core and its roles: the core knows no role, and a role is chosen at power-on."""

from __future__ import annotations

import dataclasses
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import pytest
from firmware_bench import FirmwareBench

from firmware_protocol.firmware.build_host import FIRMWARE, PARTS
from firmware_protocol.firmware.build_host import ROLES as FOLDERS
from firmware_protocol.generate.firmware_roles import (
    ANY_ROBOTS_MESSAGES,
    ANY_ROBOTS_PARAMETERS,
    NO_PARAMETER,
    ROLES,
    place,
    understood,
)
from firmware_protocol.generate.outputs import ROOT
from firmware_protocol.messages import AutopilotVersion, Command, JuniorWheels, RobotStatus, SetupSigning
from firmware_protocol.messages.fields import Sequence, Session
from firmware_protocol.wire.fields import Direction, Message, Wire

if TYPE_CHECKING:
    from pathlib import Path

SOURCES = ROOT / FIRMWARE
CORE = sorted((SOURCES / "core").iterdir())
_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
_OURS = re.compile(r'#include "((?!dialect/)[^"]+)"')
_OF_A_ROLE = re.compile(r"\b(?:MAVLINK_MSG_ID_)?(?:JUNIOR|REFEREE|SWARM|TABLE_(?:RESET|PLACE|STATE))_?\w*|\bmavlink_junior_\w+")


def code(path: Path) -> str:
    """What a compiler sees of a source: all but comments."""
    return _COMMENT.sub("", path.read_text(encoding="utf-8"))


def test_the_roles_are_where_the_build_looks_for_them() -> None:
    assert tuple(role.name for role in ROLES) == FOLDERS
    assert [role.product for role in ROLES] == sorted({role.product for role in ROLES})


@pytest.mark.parametrize("path", CORE, ids=lambda path: path.name)
def test_the_core_includes_no_header_of_a_role(path: Path) -> None:
    own = {f"core/{header.name}" for header in CORE} | {header.name for header in CORE} | {"roles.h"}
    assert set(_OURS.findall(code(path))) <= own


@pytest.mark.parametrize("path", CORE, ids=lambda path: path.name)
def test_the_core_knows_no_message_and_no_parameter_of_a_role(path: Path) -> None:
    text = code(path)
    assert not _OF_A_ROLE.findall(text)
    names = {parameter.name for role in ROLES for parameter in role.parameters} - set(ANY_ROBOTS_PARAMETERS)
    assert not names & set(re.findall(r"\w+", text))
    assert not [role.name for role in ROLES if re.search(rf"(?<!dialect/)\b{role.name}(?:_|\b)", text)]


def test_no_two_sources_of_a_board_have_one_name() -> None:
    names = [path.name for part in PARTS for path in (SOURCES / part).glob("*.c")]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("part", FOLDERS)
def test_a_role_includes_no_other_role(part: str) -> None:
    for path in (SOURCES / part).iterdir():
        for name in _OURS.findall(code(path)):
            assert name.split("/")[0] in {"core", part}, f"{path.name} includes {name}"


def test_messages_are_any_robots_or_one_roles() -> None:
    everyones = set(ANY_ROBOTS_MESSAGES)
    for role in ROLES:
        assert not everyones & set(role.messages)
        assert set(role.streams) <= set(role.messages)
    assert SetupSigning not in understood(ANY_ROBOTS_MESSAGES)


def test_a_parameter_of_any_robot_must_be_among_a_roles() -> None:
    poor = dataclasses.replace(ROLES[0], parameters=ROLES[0].parameters[:1])
    assert place(poor, "SYS_ID") == 0
    assert place(poor, "FAIL_ENABLE") == NO_PARAMETER
    with pytest.raises(ValueError, match="junior has no parameter WATCHDOG"):
        place(poor, "WATCHDOG")


@dataclass(frozen=True)
class Late(Message, id=47999, direction=Direction.DOWN, numbered=True):
    """Numbered, but something wider comes first."""

    time: Annotated[int, Wire("u64")]
    session: Session
    sequence: Sequence


def test_a_numbered_message_begins_with_its_numbers() -> None:
    assert understood([JuniorWheels, RobotStatus]) == [JuniorWheels]
    with pytest.raises(ValueError, match="LATE is numbered, and does not begin with session and sequence"):
        understood([Late])


@pytest.mark.parametrize("role", [*(role.product for role in ROLES), 255])
def test_a_robot_says_which_role_it_has(role: int) -> None:
    bench = FirmwareBench()
    bench.io.role = role
    bench.power_on()
    bench.command(Command.REQUEST_MESSAGE, AutopilotVersion.ID)
    version = bench.latest(AutopilotVersion)
    assert version is not None
    assert version.product_id == (role if role in {role.product for role in ROLES} else ROLES[0].product)
