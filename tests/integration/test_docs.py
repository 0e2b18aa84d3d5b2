"""The pages of docs/ and the README say what is so: their code runs, their commands exist, their links lead somewhere."""

from __future__ import annotations

import contextlib
import re
from typing import TYPE_CHECKING

import pytest
from doc_pages import (
    PAGES,
    ROOT,
    TOOLS,
    Block,
    blocks,
    commands,
    execute,
    execute_python,
    films,
    output_of,
    parse,
    shape,
    shown_by,
    terminal,
)

from hil.cli.app import run
from hil.sumo.ring import OPPONENTS

if TYPE_CHECKING:
    from pathlib import Path

pytest_plugins = ["pytester"]

ALL = [block for page in PAGES for block in blocks(page)]
BY_NAME = {page.name: page for page in PAGES}
STRICT = ("-W", "error", "--strict-markers", "-p", "no:cacheprovider", "-p", "no:hypothesispytest")
MARKDOWN = (
    *PAGES,
    ROOT / "CONTRIBUTING.md",
    ROOT / "docs" / "protocol.md",
    ROOT / "firmware_protocol" / "firmware" / "README.md",
)


def of(language: str, *uses: str) -> list[Block]:
    return [block for block in ALL if block.language == language and (not uses or block.use in uses)]


def anchors(page: Path) -> set[str]:
    """Names of a page's headings, as GitHub makes them."""
    heads = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


def tools(name: str) -> list[pytest.MarkDecorator]:
    """Markers of the tools that a page's Python needs."""
    return [
        getattr(pytest.mark, tool) for tool in sorted(TOOLS & {block.use for block in of("python") if block.page.name == name})
    ]


@pytest.mark.parametrize("page", MARKDOWN, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"https?://", target):
            continue
        name, _, anchor = target.partition("#")
        path = (page.parent / name).resolve() if name else page
        assert path.exists(), f"{page.name} points to {target}"
        if anchor and path.suffix == ".md":
            assert anchor in anchors(path), f"{page.name} points to {target}"


def test_every_page_is_in_the_readme() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    missing = [path.name for path in (ROOT / "docs").glob("*.md") if f"docs/{path.name}" not in readme]
    assert not missing


def test_the_table_of_opponents_has_all_of_them() -> None:
    page = (ROOT / "docs" / "coach.md").read_text(encoding="utf-8").partition("## Choose the opponent")[2].partition("\n## ")[0]
    assert re.findall(r"^\| `([\w-]+)` \|", page, re.MULTILINE) == list(OPPONENTS)


def test_the_messages_to_look_up_are_the_program_s() -> None:
    source = " ".join(
        path.read_text(encoding="utf-8")
        for package in ("firmware_protocol", "hil", "pal_advisor", "simdevice")
        for path in (ROOT / package).rglob("*.[pc]*")
        if path.suffix in {".py", ".c"} and "_build" not in path.parts
    )
    page = (ROOT / "docs" / "trouble.md").read_text(encoding="utf-8").partition("## Installing")[0]
    messages = re.findall(r"^(?:\| )?`([^`]{12,})`", page, re.MULTILINE)
    assert len(messages) > 15
    for message in messages:
        pieces = re.split(r"\.\.\.|[.:;] |/dev/\S+|[\w.:]*\d[\w.:)]*|'\w+'|[A-Z]+_\w+", message)
        words = [piece.strip(" .,:;()") for piece in pieces]
        assert any(len(piece) > 7 and piece in source for piece in words), f"nothing says {message!r}"


@pytest.mark.parametrize("block", [block for block in of("sh") if list(commands(block))], ids=str)
def test_commands_exist(block: Block) -> None:
    for arguments in commands(block):
        parse(arguments)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted({block.page.name for block in of("sh", "run")}))
def test_commands_print_what_the_page_shows(name: str, tmp_path: Path) -> None:
    printed = None
    with contextlib.chdir(tmp_path), terminal():
        for block in blocks(BY_NAME[name]):
            if block.language == "sh":
                printed = execute(block) if block.use == "run" else None
            elif block.language == "python":
                printed = None
            elif block.language == "text" and block.use == "output" and printed is not None:
                assert shape(printed) == shape(block.text), f"{block} shows something else: run tests/support/doc_pages.py"


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=tools(name)) for name in sorted({block.page.name for block in of("python")})]
)
def test_python_runs(name: str, pytester: pytest.Pytester, capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, object] = {"__name__": "page"}
    tests = 0
    page = blocks(BY_NAME[name])
    for block in page:
        if block.language != "python":
            continue
        compile(block.text, str(block.page), "exec")
        if "def test_" in block.text:
            tests += 1
            pytester.makepyfile(**{f"test_block_{tests}": block.text})
        elif block.use != "robot":
            with contextlib.chdir(pytester.path):  # where the page's tests find what it has made
                printed = execute_python(block, names)
            if (output := output_of(block, page)) is not None:
                assert shape(printed) == shape(output.text), f"{block} shows something else: run tests/support/doc_pages.py"
    capsys.readouterr()
    if tests:
        result = pytester.runpytest_inprocess(*STRICT)
        assert result.ret == 0


GALLERY = ROOT / "docs" / "gallery.md"
FILMS = films(GALLERY)


@pytest.mark.parametrize("figure", [figure for figure, _ in FILMS], ids=lambda figure: figure.stem)
def test_an_animation_shows_what_its_twin_tells(figure: Path) -> None:
    assert shown_by(figure) == figure.with_suffix(".csv").read_text(encoding="utf-8")
    assert figure.stat().st_size < 500_000


@pytest.mark.slow
@pytest.mark.parametrize(("figure", "film"), FILMS, ids=lambda path: path.stem)
def test_an_animation_is_what_the_page_s_commands_draw(figure: Path, film: Path, tmp_path: Path) -> None:
    run_folder = film.parent.as_posix()
    made = [line for block in blocks(GALLERY) if block.use == "shown" for line in commands(block)]
    (setting_up,) = [line for line in made if line[-2:] == ["--out", run_folder]]
    (drawing,) = [line for line in made if line[:2] == ["view", run_folder]]
    with contextlib.chdir(tmp_path):
        assert run([*setting_up, "--no-report", "--quiet"]) == 0
        assert run([*drawing, "--quiet"]) == 0
        shown = shown_by(film)
    assert shown == figure.with_suffix(".csv").read_text(encoding="utf-8"), "run tests/support/doc_pages.py docs/gallery.md"
