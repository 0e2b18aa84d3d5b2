"""What `hil emulate` suggests to type next can be typed as it stands."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from hil.cli.emulate import _suggestion

BUS = "can://udp_multicast/239.74.163.2?port=43114&hop_limit=0"


@pytest.mark.parametrize("url", ["tcp://127.0.0.1:5760", BUS])
def test_addresses_and_key_files_survive_the_shell(url: str) -> None:
    words = shlex.split(_suggestion(url, 1, Path("my keys/robots.key")))
    assert words.count(url) == 2
    assert words.count("my keys/robots.key") == 2


def test_what_the_shell_would_change_is_quoted() -> None:
    assert f"hil monitor '{BUS}'" in _suggestion(BUS, 1, None)
    assert f"hil monitor '{BUS}'" in _suggestion(BUS, 3, None)
