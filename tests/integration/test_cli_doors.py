"""The command line as a door: odd numbers, odd names, closed streams, files of every kind."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest
from rich.table import Table

from firmware_protocol.address import parse_address, whole_number
from firmware_protocol.errors import AddressError
from hil.cli import common
from hil.cli.app import run
from hil.files.memory_file import MemoryFileError, load_memory
from hil.sumo.connecting import connect
from hil.terminal.keys import pressed_keys
from simdevice.boards import NVM_SIZE
from simdevice.serving.opening import open_endpoint

if TYPE_CHECKING:
    from pathlib import Path

DIGITS = "9" * 5000


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_what_is_no_number_is_null_in_json(capsys: pytest.CaptureFixture[str]) -> None:
    common.print_json({"a": [math.nan, 1.5, (math.inf, 2)], "b": {"c": -math.inf}, "d": True})
    assert json.loads(capsys.readouterr().out) == {"a": [None, 1.5, [None, 2]], "b": {"c": None}, "d": True}


def test_a_negative_value_is_no_option(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["param", "sim://junior", "EYE_L_ON", "-1"]) == 2
    assert "setting parameter EYE_L_ON to -1" in capsys.readouterr().err
    assert run(["param", "sim://junior", "EYE_L_ON", "-.5e1", "--json"]) == 2
    assert "to -5" in capsys.readouterr().err
    assert run(["param", "sim://junior", "EYE_L_ON", "--sav"]) == 2
    assert "No such option" in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments",
    [
        ["param", "sim://junior", "EYE_L_ON", "nan"], ["monitor", "sim://junior", "--duration", "nan", "--no-log"],
        ["coach", "--reconnect", "nan", "--no-log"], ["coach", "--require", "inf", "--no-log", "--period", "nan"],
    ],
)  # fmt: skip
def test_nan_is_no_number_to_go_by(capsys: pytest.CaptureFixture[str], folder: Path, arguments: list[str]) -> None:
    assert run(arguments) == 2
    said = capsys.readouterr().err
    assert "Traceback" not in said
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize(
    "url",
    [
        f"sim://junior?seed={DIGITS}", f"sim://junior?count={DIGITS}", f"tcp://127.0.0.1:{DIGITS}", f"udpin://127.0.0.1:{DIGITS}",
        f"serial:///dev/ttyX:{DIGITS}", f"can://virtual/x?node={DIGITS}", f"can://virtual/x?system={DIGITS}",
        f"sim://junior?system={DIGITS}",
    ],
)  # fmt: skip
def test_a_number_of_thousands_of_digits_in_an_address(url: str) -> None:
    with pytest.raises(AddressError):
        connect(url)


def test_a_rate_of_thousands_of_digits_is_not_served() -> None:
    for text in (f"pty:{DIGITS}", f"slcan:{DIGITS}", f"tcp://127.0.0.1:{DIGITS}"):
        with pytest.raises(AddressError):
            open_endpoint(text)


def test_whole_numbers_of_addresses() -> None:
    assert whole_number("007", 9) == 7
    assert whole_number("0" * 9000, 9) == 0
    assert [whole_number(text, 255) for text in ("", "-1", "1.5", "٣", "256", "1_0", " 1")] == [None] * 7
    assert parse_address("tcp://127.0.0.1:05760").host_port() == ("127.0.0.1", 5760)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[coach]\nseed = 1.5", "line 2: --seed"),
        ("[coach]\nno-log = 1", "line 2: --no-log: expected true or false, not 1"),
        ("[coach]\nseed = true", "line 2: --seed: expected a text or a number, not true"),
        ("[coach]\nseed = [1]", "line 2: --seed: expected a text or a number, not a list"),
        ("[coach]\nseed = {a = 1}", "line 2: --seed"),
        ("seed = " + DIGITS, "line 1: a number has too many digits"),
        ("reconnect = nan", "line 1: reconnect: expected a number, not nan"),
        ("\n\nperiod = 99.0", "line 3: --period"),
        ("a = " + "[" * 3000, "this is nested too deeply"),
        ('objective = "fame"', "line 1: --objective"),
        ("config = 'x'", "unknown option 'config'"),
    ],
)
def test_a_configuration_is_tried_on_its_options(
    capsys: pytest.CaptureFixture[str], folder: Path, text: str, said: str
) -> None:
    (folder / "hil.toml").write_text(text)
    assert run(["coach", "--config", "hil.toml", "--budget", "3", "--no-log"]) == 2
    err = capsys.readouterr().err
    assert "hil.toml" in err
    assert said in err
    assert "Traceback" not in err


def test_a_configuration_from_a_windows_editor(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    (folder / "hil.toml").write_bytes('\ufeff[check]\r\nlisting = true\r\nonly = ["frames"]\r\n'.encode())
    run(["check", "--config", "hil.toml"])
    assert "hil.toml" not in capsys.readouterr().err
    (folder / "hil.toml").write_bytes("seed = 7\n".encode("utf-16"))
    assert run(["coach", "--config", "hil.toml"]) == 2
    assert "UTF-16: save it as UTF-8" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("content", "said"),
    [("EYE_L_ON = 'x'", "line 1: EYE_L_ON must be a number"), ("A = 1\nEYE_L_ON = nan", "line 2: EYE_L_ON"), ("= 1", "line 1")],
)
def test_a_parameter_file_is_named_with_its_line(
    capsys: pytest.CaptureFixture[str], folder: Path, content: str, said: str
) -> None:
    (folder / "p.toml").write_text(content)
    assert run(["param", "sim://junior", "--load", "p.toml"]) == 2
    assert f"p.toml, {said}" in capsys.readouterr().err


def test_a_memory_image_has_the_size_of_its_robots(folder: Path) -> None:
    path = folder / "junior.eeprom"
    assert load_memory(path) is None
    path.write_bytes(bytes(NVM_SIZE))
    assert load_memory(path) == bytes(NVM_SIZE)
    for count, size in ((2, NVM_SIZE), (1, NVM_SIZE - 1), (1, 0), (1, 2 << 20)):
        path.write_bytes(bytes(size))
        with pytest.raises(MemoryFileError, match=r"junior\.eeprom is no memory image"):
            load_memory(path, count)
    with pytest.raises(MemoryFileError, match="cannot read the memory image"):
        load_memory(folder)


def test_names_are_printed_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    console = common.consoles(as_json=False)
    table = Table(title="[bold]title[/] :smile:")
    table.add_column("[red]head")
    table.add_row("[/nonsense] :warning:")
    console.print(table, "[link=x]text", "a [b] :smile:")
    out = capsys.readouterr().out
    for text in ("[bold]title[/] :smile:", "[red]head", "[/nonsense] :warning:", "[link=x]text", "a [b] :smile:"):
        assert text in out


def test_without_a_standard_input_there_are_no_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    for stdin in (None, _closed()):
        monkeypatch.setattr(sys, "stdin", stdin)
        with pressed_keys() as keys:
            assert keys() == ""


def _closed() -> Any:  # noqa: ANN401 - a stream
    with open(os.devnull, encoding="utf-8") as stream:  # noqa: PTH123 - to be closed
        return stream


@pytest.mark.skipif(os.name != "posix", reason="needs a shell")
@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"])
def test_streams_that_are_closed_cost_nothing(folder: Path, closed: str) -> None:
    program = f"'{sys.executable}' -c 'from hil.cli import main; main()'"
    command = f"{program} monitor sim://junior --duration 0.2 --json --log x.mcap {closed}"
    done = subprocess.run(["/bin/sh", "-c", command], capture_output=True, text=True, timeout=120, check=False)  # noqa: S603
    assert (done.returncode, done.stderr) == (0, "")
    if ">&-" not in closed.replace("2>&-", ""):
        assert json.loads(done.stdout)["system"] == 1
    data = (folder / "x.mcap").read_bytes()
    assert data.startswith(b"\x89MCAP")
    assert data.endswith(b"\x89MCAP0\r\n")
