"""Mutants of the C core: one operator or constant of a source changed, as a slip of the hand would.

A mutant that the compiler makes the same code of is none: it can't be told from the original by any test (trivial compiler
equivalence, Papadakis et al., ICSE 2015).
"""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Final

EQUIVALENT: Final = Path(__file__).with_name("core_equivalent_mutants.toml")
"""Mutants that no test can kill, each with the reason."""

OTHERS: Final[dict[str, tuple[str, ...]]] = {
    "<": ("<=", ">"),
    "<=": ("<", ">="),
    ">": (">=", "<"),
    ">=": (">", "<="),
    "==": ("!=",),
    "!=": ("==",),
    "&&": ("||",),
    "||": ("&&",),
    "+": ("-",),
    "-": ("+",),
    "*": ("/",),
    "/": ("*",),
    "%": ("/",),
    "<<": (">>",),
    ">>": ("<<",),
    "&": ("|",),
    "|": ("&",),
    "^": ("|",),
    "++": ("--",),
    "--": ("++",),
    "+=": ("-=",),
    "-=": ("+=",),
    "*=": ("/=",),
    "/=": ("*=",),
    "&=": ("|=",),
    "|=": ("&=",),
    "^=": ("|=",),
    ">>=": ("<<=",),
    "<<=": (">>=",),
    "!": ("",),
    "~": ("",),
    "true": ("false",),
    "false": ("true",),
}
"""What may stand in place of an operator."""

_HIDDEN = re.compile(
    r"""/\*.*?\*/ | //[^\n]* | "(?:\\.|[^"\\])*" | '(?:\\.|[^'\\])*' | ^[ \t]*\#(?:\\\n|[^\n])*""",
    re.DOTALL | re.MULTILINE | re.VERBOSE,
)
_TOKEN = re.compile(
    r"(?P<number>0[xX][0-9a-fA-F]+[uUlL]*|\d+(?:\.\d*)?[fF]?[uUlL]*)|(?P<word>[A-Za-z_]\w*)|(?P<arrow>->)"
    r"|(?P<operator><<=|>>=|<=|>=|==|!=|&&|\|\||\+\+|--|[-+*/&|^]=|<<|>>|[-+*/%&|^<>!~])|(?P<other>\S)"
)
_CAST = re.compile(r"\(\s*(?:const\s+)?(?:u?int\d+_t|float|size_t|char)\s*\**\s*\)$")
_SIGNS: Final = frozenset({"-", "+", "*", "&"})
"""Operators that mean something else where a value begins."""


@dataclass(frozen=True)
class Mutant:
    """One change.

    Attributes:
        source: File of the core.
        line: Where.
        before: The line as it is, without its indentation.
        after: The line as it becomes.
        text: The whole source as it becomes.
    """

    source: str
    line: int
    before: str
    after: str
    text: str

    @property
    def key(self) -> tuple[str, str, str]:
        """What it is known by wherever its line moves."""
        return self.source, self.before, self.after

    def __str__(self) -> str:
        return f"{self.source}:{self.line}\n  - {self.before}\n  + {self.after}"


def mutants(name: str, text: str) -> list[Mutant]:
    """Every mutant of a source, in the order of the text; some may not compile.

    Args:
        name: File of the core.
        text: What is in it.
    """
    hidden = _HIDDEN.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)
    found: list[Mutant] = []
    before = ""
    for token in _TOKEN.finditer(hidden):
        found += [_mutant(name, text, token, other) for other in _instead(token, before, hidden)]
        before = token[0]
    return found


def _instead(token: re.Match[str], before: str, hidden: str) -> tuple[str, ...]:
    """What may stand in place of a token; `before` is the token before it."""
    if token["number"] is not None:
        return _constants(token["number"])
    if token["operator"] in _SIGNS:
        begins = not re.fullmatch(r"\w+|\)|\]", before) or before in {"return", "case"}
        if begins or _CAST.search(hidden, max(0, token.start() - 40), token.start()) is not None:
            return ()
    return OTHERS.get(token[0], ())


def _constants(number: str) -> tuple[str, ...]:
    """A constant off by one."""
    digits = number.rstrip("uUlL")
    suffix = number[len(digits) :]
    if digits.lower().startswith("0x"):
        value = int(digits, 16)
        return (f"{value + 1:#x}{suffix}",) if not value else (f"{value + 1:#x}{suffix}", f"{value - 1:#x}{suffix}")
    if not digits.isdigit():  # a float
        return (f"{float(digits.rstrip('fF')) + 1.0}f",)
    value = int(digits)
    return (f"{value + 1}{suffix}",) if not value else (f"{value + 1}{suffix}", f"{value - 1}{suffix}")


def _mutant(name: str, text: str, token: re.Match[str], other: str) -> Mutant:
    """The source with one token replaced."""
    changed = text[: token.start()] + other + text[token.end() :]
    line = text.count("\n", 0, token.start())
    return Mutant(name, line + 1, text.splitlines()[line].strip(), changed.splitlines()[line].strip(), changed)


def known(path: Path = EQUIVALENT) -> dict[tuple[str, str, str], str]:
    """Mutants that no test can kill: the reason by key."""
    entries = tomllib.loads(path.read_text(encoding="utf-8")).get("mutant", [])
    return {(entry["source"], entry["before"], entry["after"]): entry["reason"] for entry in entries}
