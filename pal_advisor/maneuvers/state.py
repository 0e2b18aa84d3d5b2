"""The saved state of the learner: read back, and its first wrong field named."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.vocabulary import ANY_STIMULUS
from pal_advisor.fields import Fields, SettingsError, StateError, shown
from pal_advisor.maneuvers.advice import EYES
from pal_advisor.maneuvers.decisions import DIGEST_BYTES, START, GenerationRecord
from pal_advisor.maneuvers.settings import PalSettings

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pal_advisor.maneuvers.population import Category

STATE_VERSION: Final = 3
"""3: what a situation keeps in a bout, and the model of its performances. 2: the digest, and the numbers of trials that wait
for credit, and in which generation a maneuver arose."""
OLDEST_VERSION: Final = 1


def version_of(settings: Mapping[str, Any]) -> int:
    """The version of a state: a run that was begun before there were models goes on as one of before, and its log replays.

    Args:
        settings: What `PalSettings.to_saved` gave.
    """
    return STATE_VERSION if "surrogate" in settings else STATE_VERSION - 1


def read_version(fields: Fields) -> int:
    """The version of a state, one of those that this program goes on from."""
    version = fields.take("version")
    if type(version) is not int or not OLDEST_VERSION <= version <= STATE_VERSION:
        known = f"{OLDEST_VERSION} to {STATE_VERSION}"
        raise fields.wrong("version", f"{shown(version)} is not known; this program goes on from {known}")
    return version


def read_digest(fields: Fields, version: int) -> str:
    """The digest of all decisions; in a state of version 1 it begins anew."""
    if version < 2:
        return START
    digest = fields.text("digest")
    if re.fullmatch(f"[0-9a-f]{{{2 * DIGEST_BYTES}}}", digest) is None:
        raise fields.wrong("digest", f"expected {2 * DIGEST_BYTES} hexadecimal digits, not {shown(digest)}")
    return digest


def read_settings(data: object) -> PalSettings:
    """How a run was coached."""
    if not isinstance(data, dict):
        raise StateError("settings", f"expected a table, not {shown(data)}")
    try:
        return PalSettings.of_saved(data)
    except SettingsError as error:
        raise StateError(f"settings.{error.path}", str(error).partition(": ")[2]) from error


def read_category(fields: Fields, *, arms: bool = True) -> Category:
    """The situation that a field `category` names."""
    value = fields.take("category")
    most = 15 if arms else EYES
    if not isinstance(value, list) or len(value) != 2 or any(type(code) is not int for code in value):
        raise fields.wrong("category", f"expected [previous, current], as codes of stimuli, not {shown(value)}")
    for index, code in enumerate(value):
        if not 0 <= code <= most and (index or code != ANY_STIMULUS):
            or_any = "" if index else f", or {ANY_STIMULUS} for any"
            raise fields.wrong(f"category[{index}]", f"expected a stimulus, 0 to {most}{or_any}, not {shown(code)}")
    return value[0], value[1]


def read_step(data: object, path: str) -> GenerationRecord:
    """A GP step that was made."""
    fields = Fields(data, path, StateError)
    record = GenerationRecord(
        category=read_category(fields),
        phase=fields.integer("phase", 1, 2),
        generation=fields.integer("generation"),
        used=fields.integer("used"),
        evaluations=fields.integer("evaluations"),
        best=fields.number("best"),
        mean=fields.number("mean"),
        maneuver=fields.text("maneuver"),
    )
    fields.done()
    return record
