"""What was probably meant by a word that nobody knows."""

from __future__ import annotations

from difflib import get_close_matches
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable


def nearest(word: str, known: Iterable[str]) -> str:
    """The known word that is most like one that is not known, whatever their cases.

    Args:
        word: What was written.
        known: What it might have been.

    Returns:
        The known word; empty where none is like it.
    """
    cased = {name.casefold(): name for name in known}
    found = get_close_matches(word[:100].casefold(), cased, n=1)
    return cased[found[0]] if found else ""


def did_you_mean(word: str, known: Iterable[str], written: str = "{}") -> str:
    """A question, to be put behind a complaint.

    Args:
        word: What was written.
        known: What it might have been.
        written: How it is written, with {} for the word.

    Returns:
        As `. Did you mean flat-light?`; empty where nothing is like it.
    """
    found = nearest(word, known)
    return f". Did you mean {written.replace('{}', found)}?" if found else ""
