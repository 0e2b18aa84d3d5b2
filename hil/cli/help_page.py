"""How help is set: lines end between words and nowhere else, and on a narrow terminal what an option does stands below it."""

from __future__ import annotations

import re
import textwrap
from typing import TYPE_CHECKING, Final

import typer

if TYPE_CHECKING:
    from collections.abc import Sequence

HELP: Final = {"help_option_names": ["-h", "--help"], "max_content_width": 100}
"""Context settings of every command."""
NARROW: Final = 68
"""A page of fewer columns has no room for two columns of text."""
FIRST: Final = 30
"""Widest first column of a list."""
_BELOW: Final = 6
"""By so much a text that stands below its word is indented."""


_KINDS: Final = {
    "str": "TEXT", "list[str]": "TEXT", "int": "N", "int range": "N", "float": "X", "float range": "X", "path": "FILE",
}  # fmt: skip
"""What an option takes, where its metavar does not say it."""


class HelpPage(typer.Context.formatter_class):  # type: ignore[valid-type,misc]  # typer brings a click of its own, or not
    """A page of help."""

    width: int
    current_indent: int

    def write_text(self, text: str) -> None:
        """Write paragraphs, with an empty line between each two, and examples with a line for each."""
        pieces = (" ".join(piece.split()) for piece in re.split(r"\n\s*\n", text))
        self.write("\n\n".join(self._paragraph(piece) for piece in pieces if piece) + "\n")

    def _paragraph(self, text: str) -> str:
        indent = " " * self.current_indent
        head, _, examples = text.partition(": ")
        if head not in {"Example", "Examples"}:
            return _wrapped(text, self.width, indent)
        commands = re.split(r"; (?=hil )", examples)
        lines = (_wrapped(command, self.width, f"{indent}    ", f"{indent}        ") for command in commands)
        return "\n".join([f"{indent}{head}:", *lines])

    def write_dl(self, rows: Sequence[tuple[str, str]], col_max: int = FIRST, col_spacing: int = 2) -> None:
        """Write a list of words and what each means."""
        narrow = self.width < NARROW
        first = _BELOW if narrow else min(max((len(_named(word)) for word, _ in rows), default=0), col_max) + col_spacing
        indent = " " * self.current_indent
        hanging = indent + " " * first
        for typed, meaning in rows:
            word = _named(typed)
            text = _wrapped(" ".join(meaning.split()), self.width, hanging)
            beside = not narrow and len(word) + col_spacing <= first
            head = f"{indent}{word}"
            self.write(f"{head}{text[len(head) :]}\n" if beside and text else f"{head}\n{text}\n" if text else f"{head}\n")


class HelpContext(typer.Context):
    """The context of a command: its help is set as a `HelpPage`."""

    formatter_class = HelpPage


def _named(word: str) -> str:
    """An option, or an argument, with what it takes as people write it rather than as Python calls it."""
    name, _, kind = word.partition(" <")
    if not kind:
        return word
    return name if not word.startswith("-") else f"{name} {_KINDS.get(kind.rstrip('>'), kind.rstrip('>'))}"


def _wrapped(text: str, width: int, indent: str, hanging: str | None = None) -> str:
    """A paragraph in lines that end between words; a word that is longer than a line stays whole."""
    return textwrap.fill(
        text,
        width,
        initial_indent=indent,
        subsequent_indent=indent if hanging is None else hanging,
        break_long_words=False,
        break_on_hyphens=False,
    )
