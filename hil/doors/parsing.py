"""From bytes to plain values: text, then TOML or JSON, then a look at every value. No file is touched here."""

from __future__ import annotations

import json
import math
import re
import tomllib
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Iterator

DEEPEST: Final = 32
"""Tables and lists within each other: none of ours has more than six."""
LARGEST_NUMBER: Final = 1 << 128
"""Whole numbers are smaller: the state of a random generator has 128 bits, everything else less."""
LONGEST_KEY: Final = 8
"""Names with dots between them in one TOML key: the parser's time goes with the square of them."""

_MARKS: Final = (
    (b"\xff\xfe\x00\x00", "UTF-32"),
    (b"\x00\x00\xfe\xff", "UTF-32"),
    (b"\xff\xfe", "UTF-16"),
    (b"\xfe\xff", "UTF-16"),
)
_UTF8_MARK: Final = b"\xef\xbb\xbf"
_LOOK: Final = 200
"""Bytes at the start from which an encoding without a mark is guessed."""
_TOML_PLACE: Final = re.compile(r" \(at (?:line (\d+), column \d+|end of document)\)$")
_TOML_TEXT: Final = re.compile(
    r'"""(?:[^\\"]|\\.|"(?!""))*+(?:""")?|'
    r"'''(?:(?!''').)*+(?:''')?|"
    r'"(?:[^"\n\\]|\\.)*+"?|'
    r"'[^'\n]*+'?|"
    r"#[^\n]*+",
    re.DOTALL,
)
"""Where dots do not part names: strings and comments, also such as do not end, or the search would begin again and again."""
_DOTTED: Final = re.compile(rf"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{LONGEST_KEY}}}")
_MANY_DIGITS: Final = re.compile(r"(?<!\d)[\d_]{40}")


class DocumentError(ValueError):
    """A text is not what it should be.

    Attributes:
        line: Where, from 1; 0 where that can't be told.
        path: Which field, as `entries[3].actions[1]`; empty where it is none.
    """

    def __init__(self, message: str, *, line: int = 0, path: str = "") -> None:
        super().__init__(message)
        self.line = line
        self.path = path


def decode(data: bytes) -> str:
    """Text from the bytes of a file; a mark of UTF-8 at its start, which Windows' editors write, is taken off.

    Args:
        data: The bytes.

    Returns:
        The text.

    Raises:
        DocumentError: It is no text, or in another encoding; nothing of what it holds is shown.
    """
    encoding = next((name for mark, name in _MARKS if data.startswith(mark)), "") or _unmarked(data)
    if encoding:
        raise DocumentError(f"this is text in {encoding}: save it as UTF-8")
    try:
        text = data.removeprefix(_UTF8_MARK).decode("utf-8")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise DocumentError("this is no text file in UTF-8: save it as UTF-8", line=line) from None
    if "\0" in text:
        raise DocumentError("this is no text file: it holds zero bytes", line=text.count("\n", 0, text.index("\0")) + 1)
    return text


def _unmarked(data: bytes) -> str:
    """UTF-16 without a mark, as far as its first letters are plain ones; else empty."""
    start = data[: min(_LOOK, len(data) & ~1)]
    if len(start) < 4:
        return ""
    halves = start[::2], start[1::2]
    return "UTF-16" if any(not any(one) and all(other) for one, other in (halves, halves[::-1])) else ""


def parse_json(text: str, *, infinite: bool = False) -> Any:  # noqa: ANN401 - whatever JSON says
    """Read JSON, as the standard has it: no NaN, no key twice.

    Args:
        text: The text.
        infinite: Numbers may be infinite (only those too large for a float are).

    Returns:
        Plain values.

    Raises:
        DocumentError: It is no JSON, or holds what no file of ours does; the text says where.
    """

    def pairs(found: list[tuple[str, Any]]) -> dict[str, Any]:
        table = dict(found)
        if len(table) < len(found):
            seen: set[str] = set()
            twice = next(name for name, _ in found if name in seen or seen.add(name))  # type: ignore[func-returns-value]
            raise DocumentError(f"the field {twice[:40]!r} is there twice")
        return table

    def constant(name: str) -> float:
        raise DocumentError(f"{name} is no number that JSON has", line=_line_of(text, name))

    try:
        data = json.loads(text, object_pairs_hook=pairs, parse_constant=constant)
    except json.JSONDecodeError as error:
        raise DocumentError(f"this is no valid JSON: {error.msg}, column {error.colno}", line=error.lineno) from None
    except DocumentError:
        raise
    except (ValueError, RecursionError) as error:
        raise _too_much(text, error) from None
    check_values(data, infinite=infinite)
    return data


def parse_toml(text: str, *, infinite: bool = False) -> dict[str, Any]:
    """Read TOML.

    Args:
        text: The text.
        infinite: Numbers may be infinite.

    Returns:
        Plain values.

    Raises:
        DocumentError: It is no TOML, or holds what no file of ours does; the text says where.
    """
    bare = _TOML_TEXT.sub(lambda found: '"' + "\n" * found[0].count("\n"), text)
    bare = bare.replace('"', "x")  # a name in quotation marks is a name
    if deep := _DOTTED.search(bare):
        raise DocumentError("this is nested too deeply", line=bare.count("\n", 0, deep.start()) + 1)
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        words = str(error)
        place = _TOML_PLACE.search(words)
        line = int(place[1]) if place and place[1] else text.count("\n") + 1
        raise DocumentError(f"this is no valid TOML: {words[: place.start()] if place else words}", line=line) from None
    except (ValueError, RecursionError) as error:
        raise _too_much(text, error) from None
    check_values(data, infinite=infinite)
    return data


def check_values(data: object, *, infinite: bool = False) -> None:
    """See that plain values are texts, numbers, truth values, tables and lists, and none of them monstrous.

    Args:
        data: The values.
        infinite: Numbers may be infinite.

    Raises:
        DocumentError: One is something else; its `path` says which.
    """
    open_ones: list[Iterator[tuple[Any, Any]]] = [iter([("", data)])]
    path: list[Any] = [""]
    while open_ones:
        step = next(open_ones[-1], None)
        if step is None:
            open_ones.pop()
            path.pop()
            continue
        path[-1], value = step
        kind = type(value)
        if kind is dict or kind is list:
            if len(open_ones) > DEEPEST:
                raise DocumentError("this is nested too deeply", path=_path(path[1:4]))
            open_ones.append(iter(value.items()) if kind is dict else iter(enumerate(value)))
            path.append("")
        elif wrong := _wrong(value, kind, infinite=infinite) or (isinstance(path[-1], str) and _wrong_text(path[-1])):
            raise DocumentError(wrong, path=_path(path[1:]))


def _wrong(value: Any, kind: type, *, infinite: bool) -> str:  # noqa: ANN401 - of the kind given
    """What is wrong with a single value; empty where nothing is."""
    if kind is float:
        if math.isnan(value) or (math.isinf(value) and not infinite):
            return f"expected a number, not {value}"
    elif kind is int:
        if not -LARGEST_NUMBER < value < LARGEST_NUMBER:
            return "expected a number of ordinary size"
    elif kind is str:
        return _wrong_text(value)
    elif kind is not bool and value is not None:
        return f"expected a text, a number, true or false, not a {kind.__name__}"
    return ""


def _wrong_text(text: str) -> str:
    if not text.isascii() and any("\ud800" <= letter <= "\udfff" for letter in text):
        return "expected a text, not half of a letter"
    return ""


def _path(steps: list[Any]) -> str:
    """Steps from table to table, as `entries[3].fitness`."""
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step[:60]}" for step in steps).removeprefix(".")


def _too_much(text: str, error: Exception) -> DocumentError:
    """The error of what a parser could not take in."""
    if isinstance(error, RecursionError):
        return DocumentError("this is nested too deeply")
    found = _MANY_DIGITS.search(text)
    return DocumentError(
        "a number has too many digits" if found else f"this can't be read: {str(error)[:100]}",
        line=text.count("\n", 0, found.start()) + 1 if found else 0,
    )


def _line_of(text: str, word: str) -> int:
    """The first line in which a word stands, outside strings as far as that is easily seen."""
    found = re.search(rf"(?m)(?:^|[\[:,\s]){re.escape(word)}\b", text)
    return text.count("\n", 0, found.end()) + 1 if found else 0
