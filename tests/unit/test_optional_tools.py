"""Optional tools are asked for by markers, and `tests/conftest.py` alone looks whether they are there."""

from __future__ import annotations

import ast
import tomllib
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Final, cast

import pytest
from doc_pages import PAGES, TOOLS, blocks

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

pytest_plugins = ["pytester"]

ROOT: Final = Path(__file__).parents[2]
CONFTEST: Final = ROOT / "tests" / "conftest.py"
CODE: Final = [
    path for folder in ("tests", "examples", "benchmarks") for path in sorted((ROOT / folder).rglob("*.py")) if path != CONFTEST
]
PROGRAMS: Final = {
    "avr": {"avr-gcc", "avr-g++", "avr-objdump", "avr-objcopy", "avr-size", "simavr", "make"},
    "arduino": {"arduino-builder", "arduino-cli", "arduino-ctags"},
    "node": {"node", "npm", "npx"},
    "browser": {"chromium", "chromium-browser", "google-chrome", "firefox", "chromedriver", "geckodriver"},
    "": {"git", "cmake", "clang", "gcov", "gcovr", "gdb", "docker", "socat"},
}
"""By marker: names of the programs. No marker gives those of the last row: no test runs them."""
WORDS: Final = {"node", "make", "git"}
"""Those that mean something else, too: they count only where they begin a command line."""
USES: Final = {
    "avr": ("board=avr", "/usr/include/simavr", "/usr/include/avr", "/usr/lib/avr"),
    "arduino": ("/usr/share/arduino",),
}
"""By marker: what stands in a text that asks for the tool, a robot's address say."""
MODULES: Final = {
    "avr": {
        "simdevice.avr.board",
        "simdevice.avr.micro_board",
        "simdevice.avr.build",
        "avr_bench",
        "avr_micro_twins",
        "avr_twins",
    },
    "browser": {"chromium"},
}
"""By marker: modules of no use without the tool."""
MACHINE: Final = {"Path", "hasattr", "os", "signal", "sys"}
"""What a condition for skipping a test may ask: the operating system, and what Python has of it."""
LOOKING: Final = {"which", "find_executable"}
"""Functions that look for a program."""


@cache
def parsed(source: str) -> ast.Module:
    """A module's code."""
    return ast.parse(source)


def docstrings(tree: ast.Module) -> set[ast.Constant]:
    """Texts that stand alone, as statements."""
    alone = (node.value for node in ast.walk(tree) if isinstance(node, ast.Expr))
    return {value for value in alone if isinstance(value, ast.Constant)}


def called(node: ast.AST, name: str) -> bool:
    """Whether it is the name, or an attribute of the name."""
    return (isinstance(node, ast.Name) and node.id == name) or (isinstance(node, ast.Attribute) and node.attr == name)


def markers(node: ast.AST) -> set[str]:
    """Names that stand after `pytest.mark.` in this piece of code."""
    return {found.attr for found in ast.walk(node) if isinstance(found, ast.Attribute) and called(found.value, "mark")}


def parts(tree: ast.Module) -> Iterator[tuple[ast.stmt, set[str]]]:
    """Top-level statements, each with the markers that it is under; what all tests share is under all of the module's."""
    every, whole = markers(tree), set[str]()
    for node in tree.body:
        if isinstance(node, ast.Assign) and any(called(target, "pytestmark") for target in node.targets):
            whole |= markers(node)
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            yield node, whole.union(*map(markers, node.decorator_list))
        else:
            yield node, every


def imported(tree: ast.Module) -> dict[str, str]:
    """Markers by the names that a module has from modules of no use without a tool."""
    names: dict[str, str] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            for alias in node.names:
                for marker, modules in MODULES.items():
                    if modules & {node.module, f"{node.module}.{alias.name}"}:
                        names[alias.asname or alias.name] = marker
    return names


def wanted(node: ast.stmt, names: dict[str, str], prose: set[ast.Constant]) -> Iterator[tuple[str, str]]:
    """What a piece of code asks for: the marker of a tool, and the text or name."""
    first = {found.elts[0] for found in ast.walk(node) if isinstance(found, ast.List) and found.elts}
    for found in ast.walk(node):
        if isinstance(found, ast.Name) and found.id in names:
            yield names[found.id], found.id
        elif isinstance(found, ast.Constant) and isinstance(found.value, str) and found not in prose:
            name = found.value.rpartition("/")[2]
            if name not in WORDS or found in first:
                yield from ((marker, name) for marker, programs in PROGRAMS.items() if name in programs)
            yield from ((marker, text) for marker, texts in USES.items() for text in texts if text in found.value)


def unmarked(source: str) -> list[str]:
    """What a module asks for without the marker."""
    tree = parsed(source)
    names, prose = imported(tree), docstrings(tree)
    return [
        f"line {node.lineno}: {text} needs the marker {marker or '(there is none)'}"
        for node, under in parts(tree)
        for marker, text in wanted(node, names, prose)
        if marker not in under
    ]


def looks(source: str) -> list[str]:
    """Where a module finds out by itself whether a tool is there."""
    found = []
    for node in ast.walk(parsed(source)):
        if isinstance(node, ast.ImportFrom):
            taken = {alias.name for alias in node.names}
            if taken & LOOKING or (node.module == "simdevice.avr.build" and "missing" in taken):
                found.append(f"line {node.lineno}: takes what looks for a program")
        if isinstance(node, ast.Attribute) and (
            node.attr in LOOKING or (node.attr == "missing" and called(node.value, "avr_build"))
        ):
            found.append(f"line {node.lineno}: looks for a program")
        if isinstance(node, ast.Call) and called(node.func, "skipif"):
            asked = {name.id for value in node.args for name in ast.walk(value) if isinstance(name, ast.Name)}
            if asked - MACHINE:
                found.append(f"line {node.lineno}: skips by {', '.join(sorted(asked - MACHINE))}")
    return found


def test_nothing_else_looks_for_a_tool() -> None:
    found = {str(path): looks(path.read_text(encoding="utf-8")) for path in CODE}
    assert {path: lines for path, lines in found.items() if lines} == {}


@pytest.mark.slow
def test_what_needs_a_tool_bears_its_marker() -> None:
    found = {str(path): unmarked(path.read_text(encoding="utf-8")) for path in CODE if path.name.startswith("test_")}
    del found[__file__]
    assert {path: lines for path, lines in found.items() if lines} == {}


def test_what_needs_a_tool_is_an_integration_test() -> None:
    """Where tools were hidden before, the gate looks there alone for what was skipped."""
    found = {
        path.parent.name
        for path in CODE
        if path.name.startswith("test_")
        and markers(parsed(path.read_text(encoding="utf-8"))) & (PROGRAMS.keys() - {""})
        and str(path) != __file__
    }
    assert found == {"integration", "clients"}


@pytest.mark.parametrize(
    "source",
    [
        'import shutil\nNODE = shutil.which("node")',
        "from shutil import which",
        "from simdevice.avr.build import missing",
        "MISSING = avr_build.missing()",
        'needs_avr = pytest.mark.skipif(bool(MISSING), reason="")',
    ],
)
def test_one_that_looks_is_found(source: str) -> None:
    assert looks(source)


@pytest.mark.parametrize(
    ("source", "clean"),
    [
        ('def test_x():\n    run(["avr-gcc", "-v"])', False),
        ('@pytest.mark.avr\ndef test_x():\n    run(["avr-gcc", "-v"])', True),
        ('@pytest.mark.avr\ndef test_x():\n    run(["/usr/bin/node"])', False),
        ('pytestmark = pytest.mark.avr\ndef test_x():\n    run(["make", "-C", "x"])', True),
        ('@pytest.mark.avr\ndef test_x():\n    pass\ndef test_y():\n    connect("sim://junior?board=avr")', False),
        ("from simdevice.avr.board import AvrBoard\ndef test_x():\n    AvrBoard(uid=1)", False),
        ("from simdevice.avr import build as it\n@pytest.mark.avr\ndef test_x():\n    it.build()", True),
        ("from avr_bench import UID\n@pytest.mark.avr\ndef test_x():\n    pass\ndef test_y():\n    return UID", False),
        ('def test_x():\n    """node is a number here."""\n    assert name("node") == "node"', True),
        ('def test_x():\n    run(["git", "init"])', False),
        ('def test_x():\n    """make it so"""', True),
    ],
)
def test_one_without_a_marker_is_found(source: str, *, clean: bool) -> None:
    assert (unmarked(source) == []) is clean


def test_pages_whose_code_needs_a_tool_say_so() -> None:
    for page in PAGES:
        for block in blocks(page):
            if block.language == "python" or block.use == "run":
                asks = any(text in block.text for text in ("board=avr", "board avr", "simdevice.avr", "AvrBoard"))
                assert asks == (block.use == "avr"), block


def test_every_tool_s_marker_is_known(request: pytest.FixtureRequest) -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["pytest"]["ini_options"]
    known = {line.partition(":")[0] for line in settings["markers"]}
    (conftest,) = (plugin for _, plugin in request.config.pluginmanager.list_name_plugin() if hasattr(plugin, "OPTIONAL"))
    optional = cast("dict[str, Callable[[], str]]", conftest.OPTIONAL)
    assert known >= set(optional) >= TOOLS | (set(PROGRAMS) - {""})


# --- what the conftest does ------------------------------------------------------------------------------------------

SUITE: Final = """
import pytest

@pytest.mark.{marker}
def test_marked():
    raise AssertionError("it was run")

def test_unmarked():
    pass
"""
OPTIONS: Final = ("-p", "no:cacheprovider", "-p", "no:hypothesispytest", "-rs")


@pytest.fixture
def bare(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> Callable[..., pytest.RunResult]:
    """Runs a test that needs a tool, and one that needs none, under this suite's conftest where there are no tools."""

    def run(marker: str, *arguments: str) -> pytest.RunResult:
        pytester.makeconftest(CONFTEST.read_text(encoding="utf-8"))
        pytester.makepyfile(SUITE.format(marker=marker))
        monkeypatch.setenv("PATH", str(pytester.path))
        monkeypatch.delenv("HIL_CLIENTS", raising=False)
        return pytester.runpytest_inprocess(*OPTIONS, *arguments)

    return run


@pytest.mark.filterwarnings("ignore::pytest.PytestUnknownMarkWarning")
@pytest.mark.parametrize(
    ("marker", "reason"),
    [
        ("avr", "*avr: needs gcc-avr avr-libc, make, gcc libc6-dev (on Debian or Ubuntu: sudo apt install gcc-avr *make*"),
        ("arduino", "*arduino: needs arduino-builder*sudo apt install arduino-builder*"),
        ("node", "*node: needs nodejs (on Debian or Ubuntu: sudo apt install nodejs)*"),
        ("browser", "*browser: needs chromium (on Debian or Ubuntu: sudo apt install chromium)*"),
        ("clients", "*clients: needs other people's programs (run .ci/clients*"),
    ],
)
def test_where_a_tool_is_missing_its_tests_are_skipped_and_told_why(
    bare: Callable[..., pytest.RunResult], marker: str, reason: str
) -> None:
    result = bare(marker)
    result.assert_outcomes(passed=1, skipped=1)
    result.stdout.fnmatch_lines([reason])


@pytest.mark.filterwarnings("ignore::pytest.PytestUnknownMarkWarning")
def test_where_the_tools_are_to_be_there_a_missing_one_is_an_error(bare: Callable[..., pytest.RunResult]) -> None:
    result = bare("node", "--require-tools")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*1 tests marked node need nodejs*"])


@pytest.mark.filterwarnings("ignore::pytest.PytestUnknownMarkWarning")
def test_a_tool_that_nobody_asks_for_is_not_missed(bare: Callable[..., pytest.RunResult]) -> None:
    bare("node", "--require-tools", "-m", "not node").assert_outcomes(passed=1, deselected=1)
