"""Keys that pile up over a bad line do not drive a robot on after they were let go."""

from __future__ import annotations

import pytest

from hil.jobs.monitor import worth_obeying


@pytest.mark.parametrize(
    ("pressed", "obeyed"),
    [
        ("", ""),
        ("a", "a"),
        ("^^^^^^^^", "^"),
        ("a^^>>^", "a^>^"),
        ("^^^ ", " "),
        ("^^ ^", " ^"),
        ("^^e", "e"),
        ("e^", "e^"),
        ("eda", "eda"),
        ("^^q", "^q"),
        ("e ", "e"),
        ("E ", "E"),
        (" Ee ", "E"),
        ("e  ^^", "e^"),
        ("e da", "eda"),
        ("q ", " q"),
        ("^q e^", "eq"),
    ],
)
def test_what_is_worth_obeying(pressed: str, obeyed: str) -> None:
    assert worth_obeying(pressed) == obeyed
