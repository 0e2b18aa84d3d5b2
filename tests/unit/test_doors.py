"""Doors: what they take in, what they refuse, and what they say of it."""

from __future__ import annotations

import codecs
import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from hil.doors import Document, Door
from hil.doors.parsing import DEEPEST, DocumentError, check_values, decode, parse_json, parse_toml

if TYPE_CHECKING:
    import os
    from collections.abc import Callable


class WrongError(Exception):
    """The error of the door of these tests."""


DOOR = Door("test file", WrongError, largest=10_000)
TEXT = 'name = "é"\nvalue = 3\n'


def read(path: Path, content: bytes) -> Document:
    path.write_bytes(content)
    return DOOR.document(path)


@pytest.mark.parametrize("content", [TEXT.encode(), codecs.BOM_UTF8 + TEXT.encode(), TEXT.replace("\n", "\r\n").encode()])
def test_text_comes_in_with_and_without_a_mark(tmp_path: Path, content: bytes) -> None:
    assert read(tmp_path / "x.toml", content).data == {"name": "é", "value": 3}


def test_json_comes_in_with_a_mark_too(tmp_path: Path) -> None:
    assert read(tmp_path / "x.json", codecs.BOM_UTF8 + b'{"a": [1, 2.5, true, null]}').data == {"a": [1, 2.5, True, None]}


@pytest.mark.parametrize(
    ("encoding", "named"),
    [("utf-16", "UTF-16"), ("utf-32", "UTF-32"), ("utf-16-le", "UTF-16"), ("utf-16-be", "UTF-16")],
)
def test_another_encoding_is_named_with_what_to_do(tmp_path: Path, encoding: str, named: str) -> None:
    with pytest.raises(WrongError, match=rf"x\.toml: this is text in {named}: save it as UTF-8"):
        read(tmp_path / "x.toml", 'name = "x"\n'.encode(encoding))


def test_what_is_no_text_is_named_with_its_line_and_not_shown(tmp_path: Path) -> None:
    with pytest.raises(WrongError, match=r"x\.toml, line 2: this is no text file in UTF-8: save it as UTF-8$"):
        read(tmp_path / "x.toml", b"a = 1\nb = '\xe9'\n")
    with pytest.raises(WrongError, match=r"x\.toml, line 2: this is no text file: it holds zero bytes$"):
        read(tmp_path / "x.toml", b"a = 1\nbcd = '\0'\n")
    assert decode(b"") == ""


def test_a_file_that_is_too_large_is_not_read_to_its_end(tmp_path: Path) -> None:
    with pytest.raises(WrongError, match=r"x\.toml is no test file: it is larger than 10,000 bytes"):
        read(tmp_path / "x.toml", b"#" * 10_001)
    assert read(tmp_path / "x.toml", b"#" * 10_000).data == {}


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="needs a device without end")
def test_a_device_without_end_is_too_large() -> None:
    with pytest.raises(WrongError, match="larger than"):
        DOOR.read(Path("/dev/zero"))


@pytest.mark.parametrize("path", ["nothing", "", "a\0b", "x" * 5000])
def test_what_cannot_be_read_is_the_doors_error(tmp_path: Path, path: str) -> None:
    with pytest.raises(WrongError, match="cannot read the test file"):
        DOOR.read(tmp_path / path)


def test_what_a_door_adds_where_there_is_no_file(tmp_path: Path) -> None:
    door = Door("test file", WrongError, 10, missing="there is no {path}: make one")
    with pytest.raises(WrongError, match=r"there is no .*none: make one"):
        door.read(tmp_path / "none")


def test_the_status_of_the_very_file_that_is_read_decides(tmp_path: Path) -> None:
    (tmp_path / "x").write_bytes(b"secret")
    seen: list[int] = []

    def refuse(status: os.stat_result) -> str:
        seen.append(status.st_size)
        return "not allowed"

    with pytest.raises(WrongError, match=r"^not allowed$"):
        DOOR.read(tmp_path / "x", allowed=refuse)
    assert seen == [6]


@pytest.mark.parametrize(
    ("suffix", "text", "said"),
    [
        ("toml", "a = 1\nb = [\n", "this is no valid TOML"),
        ("toml", "a = 1\nb = nan\n", "line 2: b: expected a number, not nan"),
        ("toml", "a = 1\n[c]\nd = -inf\n", "line 3: c.d: expected a number, not -inf"),
        ("toml", "a = 1\nb = 2020-01-01\n", "line 2: b: expected a text, a number, true or false, not a date"),
        ("toml", "a = 1\nb = " + "9" * 5000, "line 2: a number has too many digits"),
        ("toml", "a = 1\nb = " + "9" * 50, "line 2: b: expected a number of ordinary size"),
        ("toml", "a = 1\nb = " + "[" * 4000, "this is nested too deeply"),
        ("toml", "a = 1\nb = " + "[" * 40 + "]" * 40, "line 2: b[0][0]: this is nested too deeply"),
        ("toml", "a = 1\n" + "b." * 4000 + "c = 1", "line 2: this is nested too deeply"),
        ("toml", "a = 1\n[" + '"b" . ' * 1500 + "c]", "line 2: this is nested too deeply"),
        ("toml", "a = 1\na = 2\n", "line 2: this is no valid TOML: Cannot overwrite a value"),
        ("json", '{"a": 1,\n"b": NaN}', "line 2: NaN is no number that JSON has"),
        ("json", '{"a": 1,\n"b": [-Infinity]}', "line 2: -Infinity is no number that JSON has"),
        ("json", '{"a": 1,\n"b": 1e999}', "b: expected a number, not inf"),
        ("json", '{"a": 1,\n"b": ' + "9" * 5000 + "}", "line 2: a number has too many digits"),
        ("json", '{"a": 1,\n"b": ' + "[" * 5000, "this is nested too deeply"),
        ("json", '{"a": 1,\n"a": 2}', "the field 'a' is there twice"),
        ("json", '{"a": 1,\n"b" 2}', "line 2: this is no valid JSON: Expecting ':' delimiter, column 5"),
        ("json", '{"a": "\\ud800"}', "a: expected a text, not half of a letter"),
        ("json", '{"\\ud800": 1}', "expected a text, not half of a letter"),
        ("json", "", "line 1: this is no valid JSON: Expecting value"),
    ],
)
def test_what_no_file_of_ours_holds_is_named_with_its_place(tmp_path: Path, suffix: str, text: str, said: str) -> None:
    path = tmp_path / f"x.{suffix}"
    with pytest.raises(WrongError) as caught:
        read(path, text.encode())
    assert str(caught.value).startswith(str(path))
    assert said in str(caught.value)
    assert len(str(caught.value)) < len(str(path)) + 200


def test_infinity_comes_in_where_it_means_something(tmp_path: Path) -> None:
    (tmp_path / "x.toml").write_text("a = inf\n")
    door = Door("test file", WrongError, 100, infinite=True)
    assert door.document(tmp_path / "x.toml").data == {"a": float("inf")}
    (tmp_path / "x.toml").write_text("a = nan\n")
    with pytest.raises(WrongError, match="not nan"):
        door.document(tmp_path / "x.toml")


def test_dots_in_texts_and_comments_nest_nothing() -> None:
    dots = "a.b.c.d.e.f.g.h.i.j.k"
    text = f'# {dots}\nx = "{dots} # \\" {dots}"\ny = \'{dots}\'\nz = """\n{dots}\n"""\nw = \'\'\'{dots}\'\'\'\na.b.c.d = 1\n'
    assert parse_toml(text)["a"]["b"]["c"]["d"] == 1


@pytest.mark.parametrize("make", [lambda depth: "[" * depth + "]" * depth, lambda depth: '{"a":' * depth + "1" + "}" * depth])
def test_the_deepest_there_may_be(make: Callable[[int], str]) -> None:
    parse_json(make(DEEPEST))
    with pytest.raises(DocumentError, match="nested too deeply"):
        parse_json(make(DEEPEST + 1))


@pytest.mark.parametrize(
    "text",
    [
        '"' * 60_000, "'" * 60_000, '"""\\' * 15_000, "a" * 60_000, "a." * 30_000, "a-" * 30_000, "[" * 60_000, "{a=" * 20_000,
        "\\" * 60_000, "1_" * 30_000, "[[a]]\n" * 10_000, "a.a.a.a.a.a.a=1\n" * 3800, "#" * 60_000, "'''\"\"\"" * 10_000,
        '"\\' * 30_000, "a'" * 30_000, "x=" + "{a.b.c.d.e.f=1," * 4000,
        "\n" * 60_000, "x = [" + "{}," * 20_000 + "]", "".join(f"a{n}.b.c.d.e.f.g = {n}\n" for n in range(2500)),
    ],
)  # fmt: skip
def test_a_file_made_to_be_slow_is_not(text: str) -> None:
    """Each of these is as large as the door of faults allows; the parser alone would take some of them minutes."""
    begun = time.process_time()
    for parse in (parse_toml, parse_json):
        with suppress(DocumentError):
            parse(text)
    assert time.process_time() - begun < 5.0  # a backstop: none takes half a second


def test_plain_values_pass() -> None:
    check_values({"a": [1, 2.5, "x", True, None, {"b": -(2**127)}]})
    with pytest.raises(DocumentError) as caught:
        check_values({"a": [1, {"b": {1}}]})
    assert caught.value.path == "a[1].b"


def test_a_field_is_found_by_the_document(tmp_path: Path) -> None:
    document = read(tmp_path / "x.toml", b"a = 1\n[b]\nno-log = 2\n")
    assert str(document.wrong("b.no-log", "b.no-log: wrong")) == f"{tmp_path / 'x.toml'}, line 3: b.no-log: wrong"
    assert str(document.wrong("", "wrong")) == f"{tmp_path / 'x.toml'}: wrong"
