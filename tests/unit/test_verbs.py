"""Verbs are listed without being imported, and what is listed is what they say themselves."""

from __future__ import annotations

import inspect
import os
import subprocess
import sys
from importlib import import_module, metadata
from typing import TYPE_CHECKING

import pytest
from completion_table import PLACE, table

import hil
from hil.cli.app import Verbs, run
from hil.cli.completion import described
from hil.cli.emulating import Emulated
from hil.cli.help_page import NARROW
from hil.cli.log_app import LogVerbs
from hil.cli.swarm.app import SwarmVerbs

if TYPE_CHECKING:
    from hil.cli.verbs import Verb

GROUPS = {"": Verbs, "emulate": Emulated, "log": LogVerbs, "swarm": SwarmVerbs}
ALL = [(group, verb) for group, verbs in GROUPS.items() for verb in verbs.VERBS]
NAMES = [f"{group} {verb.name}".strip() for group, verb in ALL]


def asked(*command: str, **variables: str) -> str:
    """What a program of its own prints, and which of our modules it has loaded: one a line, with a # before it."""
    program = (
        "import sys; sys.argv[0] = 'hil'\ntry:\n from hil.cli import main; main()\n"
        "finally: print(*('#' + name for name in sys.modules if name.startswith('hil.')), sep='\\n')"
    )
    done = subprocess.run(  # noqa: S603 - our own program
        [sys.executable, "-c", program, *command],
        env={**os.environ, "COLUMNS": "80", **variables},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize(("group", "verb"), ALL, ids=NAMES)
def test_what_is_listed_is_how_the_verb_s_help_begins(group: str, verb: Verb) -> None:
    module, _, name = verb.home.partition(":")
    found = getattr(import_module(module), name)
    said = (found.info.help if verb.name in GROUPS and not group else inspect.getdoc(found)) or ""
    assert " ".join(said.split()).startswith(verb.summary)
    assert verb.summary.endswith(".")


@pytest.mark.parametrize("columns", [40, 60, 80, 120])
@pytest.mark.parametrize("group", GROUPS)
def test_summaries_are_whole_at_any_width(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, group: str, columns: int
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    assert run([*group.split(), "--help"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    for verb in GROUPS[group].VERBS:
        assert f" {verb.name} {verb.summary}" in said


@pytest.mark.parametrize("columns", [60, 80, 120])
@pytest.mark.parametrize("name", NAMES)
def test_help_is_as_wide_as_the_terminal_and_breaks_no_word(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, name: str, columns: int
) -> None:
    texts = []
    for width in (columns, 400):
        monkeypatch.setenv("COLUMNS", str(width))
        assert run([*name.split(), "-h"]) == 0
        texts.append(capsys.readouterr().out)
    assert texts[0].split() == texts[1].split()
    assert max(len(line) for line in texts[0].splitlines()) <= columns
    options = texts[0].partition("Options:\n")[2].splitlines()
    below = columns - 2 < NARROW
    assert any(line.startswith(("  -q, --quiet", "  -h, --help")) for line in options)
    assert ("  -h, --help" in options) == below


@pytest.mark.slow
def test_the_list_of_verbs_imports_none() -> None:
    said = asked("--help")
    assert "coach" in said
    loaded = {line for line in said.splitlines() if line.startswith("#")}
    assert loaded == {
        "#hil.cli",
        "#hil.cli.app",
        "#hil.cli.completion",
        "#hil.cli.help_page",
        "#hil.cli.loading",
        "#hil.cli.verbs",
    }


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("hil ", [verb.name for verb in Verbs.VERBS]),
        ("hil re", ["replay", "report"]),
        ("hil emulate ", ["junior", "swarm"]),
        ("hil log d", ["diff"]),
        ("hil coach --o", ["--opponent", "--objective", "--open", "--out", "--overwrite"]),
        ("hil coach --opponent f", ["flat-light", "flat-heavy"]),
        ("hil coach --opponent f --no-r", ["--no-report"]),
        ("hil emulate swarm --wa", ["--wall"]),
        ("hil monitor a", ["auto"]),
    ],
)
def test_a_shell_completes_names_of_verbs_and_none_is_imported(words: str, offered: list[str]) -> None:
    said = asked(_HIL_COMPLETE="complete_bash", COMP_WORDS=words, COMP_CWORD=str(words.count(" ")))
    lines = said.splitlines()
    assert [line for line in lines if not line.startswith("#")] == offered
    assert not {line for line in lines if line.startswith(("#hil.jobs", "#hil.connecting", "#hil.cli.common"))}


def test_the_options_that_a_shell_is_told_are_those_of_the_verbs() -> None:
    assert PLACE.read_text(encoding="utf-8") == table(), "python tests/support/completion_table.py writes them anew"


def test_the_table_says_so_where_it_does_not_know_a_verb() -> None:
    assert described("hil.cli.coach:dance") is None


def test_a_verb_that_is_nearly_right_is_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["coch"]) == 2
    assert "Did you mean 'coach'?" in capsys.readouterr().err
    assert run(["swarm", "surond"]) == 2
    assert "Did you mean 'surround'?" in capsys.readouterr().err


def test_the_package_says_its_version_and_what_is_in_it() -> None:
    assert hil.__version__ == metadata.version("junior-hil")
    assert dir(hil) == sorted(hil.__all__)
    assert "connect" in dir(hil)
    for name in dir(hil):
        assert getattr(hil, name) is not None
