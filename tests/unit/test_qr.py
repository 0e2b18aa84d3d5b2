"""An address as a QR code: what the lines show is the code, and it is left out where the terminal can't show it."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from hil.cli.qr import QUIET_ZONE, halves, show_qr

ADDRESS = "http://192.168.100.100:65535/AAAAAAAAAAAAAAAAAAAAAA/"


def shown() -> str:
    """What is printed on a terminal."""
    file = io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
    console = Console(file=file, force_terminal=True, width=80, color_system="truecolor")
    show_qr(ADDRESS, console)
    file.flush()
    return file.buffer.getvalue().decode()


def test_two_rows_are_one_line() -> None:
    rows = [(True, False, True), (False, False, True), (False, True, True)]
    assert halves(rows) == ["▀ █", " ▀▀"]


def test_the_code_is_on_the_terminal_dark_on_light() -> None:
    segno = pytest.importorskip("segno")
    said = shown()
    lines = [line.partition("m")[2].partition("\x1b")[0] for line in said.splitlines()]
    rows = [row for line in lines for row in ([one in "▀█" for one in line], [one in "▄█" for one in line])]
    code = [list(map(bool, row)) for row in segno.make_qr(ADDRESS, error="l").matrix_iter(border=QUIET_ZONE)]
    assert rows[: len(code)] == code
    assert not any(any(row) for row in rows[len(code) :])
    assert all(line.startswith("\x1b[38;2;0;0;0;48;2;255;255;255m") for line in said.splitlines())
    assert len(lines[0]) <= 45


@pytest.mark.parametrize(
    "options", [{"color_system": None}, {"no_color": True}, {"width": 30}, {"encoding": "ascii"}, {"force_terminal": False}]
)
def test_nothing_is_printed_where_it_could_not_be_read(options: dict[str, object]) -> None:
    file = io.TextIOWrapper(io.BytesIO(), encoding=str(options.pop("encoding", "utf-8")))
    console = Console(file=file, **{"force_terminal": True, "width": 80, "color_system": "truecolor", **options})  # type: ignore[arg-type]
    show_qr(ADDRESS, console)
    file.flush()
    assert not file.buffer.getvalue()
