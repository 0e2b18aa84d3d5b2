"""The generated files that are checked in are what the messages say."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from firmware_protocol.generate.__main__ import main
from firmware_protocol.generate.outputs import OUTPUTS, ROOT, stale

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize("name", OUTPUTS)
def test_is_up_to_date(name: str) -> None:
    assert (ROOT / name).read_text(encoding="utf-8") == OUTPUTS[name](), "run python -m firmware_protocol.generate"


def test_check_says_which_file_is_old(tmp_path: Path) -> None:
    for name, make in OUTPUTS.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(make(), encoding="utf-8")
    assert stale(tmp_path) == []
    changed, missing = list(OUTPUTS)[:2]
    (tmp_path / changed).write_text("edited by hand", encoding="utf-8")
    (tmp_path / missing).unlink()
    assert stale(tmp_path) == [changed, missing]


def test_check_passes_on_this_tree() -> None:
    assert main(["--check"]) == 0
