"""The pages of docs/ as programs: their blocks are run, and `python tests/support/doc_pages.py` takes down what they print.

The word after a block's language says what it is:

    sh run          commands of `hil` and `pytest`, run by the tests; a `text output` block after it must look like what they
                    print
    sh shown        likewise, but it takes too long for the tests: only the command lines are checked
    sh              commands of `hil` that need a robot or a second shell: only the command lines are checked
    python          run by the tests; blocks of a page share their names; one with `def test_` is given to pytest; a `text
                    output` block right after it must look like what it prints
    python robot    needs a robot or a second shell: only compiled
    python avr      as python, but needs an optional tool, whose marker the page's test bears; likewise node, browser

Blocks of a page run in order, in one folder of the page's own. A picture `figures/RUN-NAME.png` is NAME.png of runs/RUN, or of
the report that the page's commands make of it; another page may make it. `figures/RUN-NAME.gif` is NAME.gif that they leave in
runs/RUN, and what it shows is put beside it, to be read.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer.main
from PIL import Image

from hil.cli.app import app, run

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "README.md", *sorted(path for path in (ROOT / "docs").glob("*.md") if path.name != "protocol.md"))
TOOLS = frozenset({"avr", "node", "browser"})
"""Optional tools that a block of Python may need, by the marker of tests that need them."""
WIDTH = 100
"""Columns of the terminal whose output the pages show."""
_BLOCK = re.compile(r"^```([a-z]+)(?: ([a-z]+))?\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Block:
    """A fenced block.

    Attributes:
        page: File it stands in.
        line: Line of its first line of text, from 1.
        language: Word after the fence.
        use: Second word; empty for none.
        text: What stands in it.
        start: Where its text begins in the page.
    """

    page: Path
    line: int
    language: str
    use: str
    text: str
    start: int

    def __str__(self) -> str:
        return f"{self.page.name}:{self.line}"


def blocks(page: Path) -> list[Block]:
    """All fenced blocks of a page, in order."""
    text = page.read_text(encoding="utf-8")
    return [
        Block(page, text.count("\n", 0, match.start(3)) + 1, match[1], match[2] or "", match[3], match.start(3))
        for match in _BLOCK.finditer(text)
    ]


def commands(block: Block) -> Iterator[list[str]]:
    """Arguments of every `hil` in a shell block."""
    for program, arguments in programs(block):
        if program == "hil":
            yield arguments


def programs(block: Block) -> Iterator[tuple[str, list[str]]]:
    """Each `hil` and `pytest` in a shell block, with its arguments."""
    for line in block.text.replace("\\\n", " ").splitlines():
        for part in re.split(r"&&|\|\||;|\||\s&(?=\s|$)", line.partition(" #")[0]):
            words = shlex.split(re.sub(r"\s[12]?>\S*\s*\S+", " ", part))
            if words and words[0] in {"hil", "pytest"}:
                yield words[0], words[1:]


def parse(arguments: list[str]) -> None:
    """Check a command line without doing what it says; raises what the parser raises."""
    group: Any = typer.main.get_command(app)
    if arguments and not arguments[0].startswith("-"):
        assert arguments[0] in group.commands, f"there is no hil {arguments[0]}"
        command = group.commands[arguments[0]].verb.load()
        while getattr(command, "commands", None) and arguments[1:]:
            assert arguments[1] in command.commands, f"there is no hil {arguments[0]} {arguments[1]}"
            arguments = arguments[1:]
            command = command.commands[arguments[0]].verb.load()
        command.make_context(arguments[0], arguments[1:])


def execute(block: Block) -> str:
    """Run the commands of a block in the current folder, and return what they print."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
        for program, arguments in programs(block):
            if program == "hil":
                run(arguments)
            else:
                print(_pytest(arguments))  # noqa: T201 - it is caught
    return "\n".join(line.rstrip() for line in out.getvalue().splitlines()).strip("\n") + "\n"


def _pytest(arguments: list[str]) -> str:
    """What pytest prints in the current folder; in a process of its own, as it would be."""
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - our own pages
    return f"{done.stdout}{done.stderr}"


def execute_python(block: Block, names: dict[str, object]) -> str:
    """Run a block of Python in the current folder, and return what it prints.

    Args:
        block: The block.
        names: The page's names.
    """
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        exec(compile("\n" * (block.line - 1) + block.text, str(block.page), "exec"), names)  # noqa: S102 - our own pages
    return out.getvalue()


def output_of(block: Block, page: list[Block]) -> Block | None:
    """The `text output` block that follows a block, if one does.

    Args:
        block: The block.
        page: All blocks of its page.
    """
    after = page[page.index(block) + 1 : page.index(block) + 2]
    return after[0] if after and (after[0].language, after[0].use) == ("text", "output") else None


def shape(text: str) -> list[str]:
    """What is left of an output when its figures, rules and spaces are taken away: its words."""
    words = re.sub(r"[\d.]*\d[\d.]*", "#", re.sub(r"[^\w\s.,:;()/%'>#-]|-{2,}", " ", text))
    return words.split()


@contextlib.contextmanager
def terminal() -> Iterator[None]:
    """A terminal of the pages' width, without colours."""
    before = {name: os.environ.get(name) for name in ("COLUMNS", "NO_COLOR", "TERM")}
    os.environ.update(COLUMNS=str(WIDTH), NO_COLOR="1", TERM="dumb")
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def refresh(page: Path) -> None:
    """Run a page's commands and put what they print into the page."""
    text = page.read_text(encoding="utf-8")
    found = blocks(page)
    outputs: list[tuple[Block, str]] = []
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), terminal():
        printed = ""
        names: dict[str, object] = {"__name__": "page"}
        shows = any(block.language == "python" and output_of(block, found) for block in found)
        for block in found:
            if block.language == "sh" and block.use in {"run", "shown"}:
                printed = execute(block)
            elif shows and block.language == "python" and block.use != "robot" and "def test_" not in block.text:
                printed = execute_python(block, names)
            elif block.language == "text" and block.use == "output":
                outputs.append((block, printed))
        for figure, made, name in re.findall(r"\]\((figures/([\w-]+)-(\w+)\.png)\)", text):
            folder_of_run = Path("runs") / made
            if not folder_of_run.exists():
                continue  # another page's commands make it
            picture = folder_of_run / f"{name}.png"
            if not picture.exists():
                picture = folder_of_run / "report" / f"{name}.png"
            if not picture.exists():
                run(["report", str(picture.parent.parent), "--png", "--quiet"])
            shutil.copyfile(picture, page.parent / figure)
        for figure, film in films(page):
            shutil.copyfile(film, figure)
            figure.with_suffix(".csv").write_text(shown_by(film), encoding="utf-8")
    for block, new in reversed(outputs):
        text = text[: block.start] + new + text[block.start + len(block.text) :]
    page.write_text(text, encoding="utf-8")


def shown_by(picture: Path) -> str:
    """What an animation says that it shows (`hil.look.film.course.twin_of`)."""
    with Image.open(picture) as image:
        comment: bytes = image.info["comment"]
    return comment.decode()


def films(page: Path) -> list[tuple[Path, Path]]:
    """Each animation in a page, and where the page's commands leave it in the folder they are run in."""
    found = re.findall(r"\]\((figures/([\w-]+)-(\w+)\.gif)\)", page.read_text(encoding="utf-8"))
    return [(page.parent / figure, Path("runs") / made / f"{name}.gif") for figure, made, name in found]


if __name__ == "__main__":
    for name in sys.argv[1:] or [str(page) for page in PAGES]:
        refresh(Path(name).resolve())
