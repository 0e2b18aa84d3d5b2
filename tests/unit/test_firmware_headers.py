"""The message headers of the firmware: made when they are old, and whole or not at all."""

from __future__ import annotations

import os
import runpy
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from firmware_protocol.generate.outputs import ROOT

if TYPE_CHECKING:
    from collections.abc import Callable

HEADERS: dict[str, Any] = runpy.run_path(str(Path(ROOT) / "firmware_protocol" / "firmware" / "headers.py"))
make_headers: Callable[[Path], Path] = HEADERS["make_headers"]


def test_they_are_made_once_and_again_when_the_dialect_is_newer(tmp_path: Path) -> None:
    last = tmp_path / HEADERS["LAST"]
    make_headers(tmp_path)
    text = last.read_text(encoding="utf-8")
    last.write_text("mine", encoding="utf-8")
    make_headers(tmp_path)
    assert last.read_text(encoding="utf-8") == "mine"
    os.utime(last, (0, 0))
    make_headers(tmp_path)
    assert last.read_text(encoding="utf-8") == text
    assert sorted(path.name for path in tmp_path.iterdir() if path.is_dir()) == ["junior"], "nothing else is left"


def test_an_interruption_leaves_nothing_that_passes_for_headers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(path: Path, target: Path) -> Path:
        if path.name.startswith("mavlink_msg_ping"):
            raise KeyboardInterrupt
        return rename(path, target)

    rename = Path.replace
    monkeypatch.setattr(Path, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        make_headers(tmp_path)
    assert not (tmp_path / HEADERS["LAST"]).exists()
    monkeypatch.undo()
    make_headers(tmp_path)
    assert (tmp_path / "junior" / "mavlink_msg_ping.h").exists()


def test_without_pymavlink_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pymavlink.generator.mavgen", None)
    with pytest.raises(RuntimeError, match="pip install pymavlink"):
        make_headers(tmp_path)
