"""The firmware fits an ATmega328P, and the tool that says so sees what it must see."""

from __future__ import annotations

import os
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

from firmware_protocol.generate.outputs import ROOT

FIRMWARE = Path(ROOT) / "firmware_protocol" / "firmware"
SIZE = runpy.run_path(str(FIRMWARE / "size.py"))

DISASSEMBLY = """
00000100 <main>:
 100:\tcf 93       \tpush\tr28
 102:\tcd b7       \tin\tr28, 0x3d\t; 61
 104:\tc8 58       \tsubi\tr28, 0x88\t; 136
 106:\td1 40       \tsbci\tr29, 0x01\t; 1
 108:\t0e 94 00 01 \tcall\t0x200\t; 0x200 <small>
 10c:\t0e 94 80 01 \trcall\t.+502\t; 0x300 <library>
 110:\t08 95       \tret

00000200 <small>:
 200:\t1f 93       \tpush\tr17
 202:\t08 95       \tret

00000300 <library>:
 300:\t1f 93       \tpush\tr17
 302:\t01 c0       \trjmp\t.+2\t; 0x310 <library_loop>

00000310 <library_loop>:
 310:\t1f 93       \tpush\tr16
 312:\t01 f0       \tbreq\t.-18\t; 0x302 <library+0x2>
 314:\t08 95       \tret
"""


def test_the_deepest_chain_is_found() -> None:
    functions = SIZE["read_functions"](DISASSEMBLY)
    functions[0x100].frame = 405  # as the compiler reports it
    graph = SIZE["CallGraph"](functions, {"main", "small"})
    assert graph.deepest(0x100) == (405 + 4, [("main", 405), ("library", 4)])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("push\tr17\n 202:\t08 95       \tret", "rcall\t.-258\t; 0x100 <main>\n 202:\t08 95       \tret"), "recursion"),
        (("push\tr17\n 202:", "icall\n 202:"), "pointer"),
    ],
)
def test_what_cannot_be_bounded_is_an_error(change: tuple[str, str], message: str) -> None:
    assert change[0] in DISASSEMBLY
    graph = SIZE["CallGraph"](SIZE["read_functions"](DISASSEMBLY.replace(*change)), {"main", "small"})
    with pytest.raises(ValueError, match=message):
        graph.deepest(0x100)


@pytest.mark.slow
@pytest.mark.avr
def test_it_fits_the_micro_controller(tmp_path: Path) -> None:
    made = subprocess.run(  # noqa: S603
        ["make", "-C", str(FIRMWARE), "size", f"PYTHON={sys.executable}", f"BUILD={tmp_path}"],  # noqa: S607
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"MAKEFLAGS": ""},
    )
    assert made.returncode == 0, made.stdout + made.stderr
    assert "flash" in made.stdout
    assert "deepest main" in made.stdout
