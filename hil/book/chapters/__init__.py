"""The claims, chapter by chapter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from hil.book.chapters import chapter6, chapter7, chapter8, chapter9

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from hil.book.claim import Claim

CHAPTERS: Final[Mapping[str, Sequence[Claim]]] = {
    "Chapter 6: the method": chapter6.CLAIMS,
    "Chapter 7: what is learnt": chapter7.CLAIMS,
    "Chapter 8: what matters": chapter8.CLAIMS,
    "Chapter 9: evolution": chapter9.CLAIMS,
}
"""All claims, by heading of their chapter."""
