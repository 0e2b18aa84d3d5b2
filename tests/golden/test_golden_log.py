"""A log written earlier is read as it was meant, and the same calls still write a log of the same content."""

from __future__ import annotations

from typing import TYPE_CHECKING

from golden_log import GOLDEN, TWIN, describe, write_small_log

if TYPE_CHECKING:
    from pathlib import Path


def test_the_golden_log_reads_as_its_twin_says() -> None:
    assert describe(GOLDEN) == TWIN.read_text("utf-8")


def test_writing_it_again_gives_the_same_content(tmp_path: Path) -> None:
    write_small_log(tmp_path / "again.mcap")
    assert describe(tmp_path / "again.mcap") == TWIN.read_text("utf-8")
