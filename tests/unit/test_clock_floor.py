"""Above the bridge nobody reads a clock or draws by chance, but by what a log holds: the few exceptions are listed here.

What is imported for annotations alone is no matter.
"""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Final

import pytest

import hil
import pal_advisor

SOURCES: Final = frozenset(
    {"time", "secrets", "random", "datetime", "uuid", "MonotonicClock", "urandom", "getrandom", "default_rng()"}
)
"""Modules that tell the time or draw by chance, the machine's clock, the system's random bytes, a generator without a seed."""
ALLOWED: Final[dict[str, tuple[frozenset[str], str]]] = {
    "hil.bridge.clock": (frozenset({"time"}), "is the machine's clock, which bridges and probes read once a step"),
    "hil.bridge.sessions": (frozenset({"secrets"}), "draws session numbers, of which bridges tell their taps"),
    "hil.signing.key_file": (
        frozenset({"secrets", "time"}),
        "draws new keys; reads the calendar once, of which a bridge tells its taps",
    ),
    "hil.connecting.connecting": (frozenset({"MonotonicClock"}), "makes the clock that the bridge reads"),
    "hil.connecting.connecting_all": (frozenset({"MonotonicClock"}), "makes the clock that the bridges read"),
    "hil.connecting.discovery": (frozenset({"MonotonicClock"}), "looks for robots before there is a bridge"),
    "hil.pytest_plugin": (frozenset({"MonotonicClock"}), "serves a robot to another process, in real time: it is no host"),
    "hil.look.live.server": (frozenset({"secrets"}), "draws the token of a page's address, of which no run hears"),
    "hil.look.live.showing": (
        frozenset({"time"}),
        "measures in the recorder's process how long a part of a page took to make, so as to leave the log time",
    ),
    "hil.pytest_logs": (frozenset({"datetime"}), "says in the metadata of a failing test's log when that began"),
    "hil.runs": (frozenset({"datetime"}), "names folders after the calendar time that it is given, and reads it back"),
    "hil.cli.emulate": (frozenset({"MonotonicClock"}), "serves a robot to another process, in real time: it is no host"),
    "hil.cli.emulate_swarm": (frozenset({"MonotonicClock"}), "serves robots to another process, in real time: it is no host"),
    "hil.cli.emulate_live": (
        frozenset({"datetime", "time"}),
        "says on a page since when robots are served: no host",
    ),
    "hil.cli.replay_viewer": (
        frozenset({"MonotonicClock"}),
        "plays a log to viewers in its own time: no host",
    ),
    "hil.cli.swarm.surround_files": (frozenset({"MonotonicClock"}), "tells a person how long the run took"),
    "hil.cli.swarm.evolve": (frozenset({"MonotonicClock"}), "tells a person how long the search took"),
    "hil.cli.coach": (frozenset({"MonotonicClock"}), "tells a person how fast the run goes"),
    "hil.cli.coach_team": (frozenset({"MonotonicClock"}), "tells a person how long the runs took"),
    "hil.cli.running": (frozenset({"datetime"}), "names the run's folder, and says when it was made"),
    "hil.cli.stage": (
        frozenset({"MonotonicClock", "datetime", "time"}),
        "makes the clock that the bridge reads; says in the log's metadata when the run began",
    ),
}
"""What may be used, by module, and why; a package stands for the modules in it."""


def runtime(tree: ast.AST) -> list[ast.AST]:
    """All nodes but those for type checkers alone."""
    nodes, waiting = [], [tree]
    while waiting:
        node = waiting.pop()
        nodes.append(node)
        if isinstance(node, ast.If) and ast.unparse(node.test) in {"TYPE_CHECKING", "typing.TYPE_CHECKING"}:
            waiting += node.orelse
        else:
            waiting += ast.iter_child_nodes(node)
    return nodes


def sources(text: str) -> set[str]:
    """What a module uses of `SOURCES`."""
    found: set[str] = set()
    for node in runtime(ast.parse(text)):
        match node:
            case ast.Import(names=names):
                found |= {alias.name.partition(".")[0] for alias in names}
            case ast.ImportFrom(module=module, names=names, level=level):
                found |= {alias.name for alias in names}
                found |= {module.partition(".")[0]} if module and not level else set()
            case ast.Attribute(attr=name):
                found.add(name) if name in {"urandom", "getrandom", "MonotonicClock"} else None
            case ast.Call(func=ast.Attribute(attr="default_rng") | ast.Name(id="default_rng"), args=[], keywords=[]):
                found.add("default_rng()")
    return found & SOURCES


def modules(package: str, folder: Path) -> dict[str, Path]:
    """All modules of a package, by name."""
    named = {}
    for path in folder.rglob("*.py"):
        parts = [package, *path.relative_to(folder).with_suffix("").parts]
        named[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return named


MODULES = {
    name: path
    for package in (hil, pal_advisor)
    for name, path in modules(package.__name__, Path(str(package.__file__)).parent).items()
}


def test_it_is_looked_everywhere() -> None:
    assert {"hil", "hil.sumo.junior", "hil.cli.app", "hil.mcaplog.reading.reader", "pal_advisor.maneuvers"} <= MODULES.keys()


def test_nobody_reads_a_clock_or_draws_by_chance_who_may_not() -> None:
    used = {name: sources(path.read_text(encoding="utf-8")) for name, path in MODULES.items()}
    beyond = {name: found - ALLOWED.get(name, (frozenset(), ""))[0] for name, found in used.items()}
    assert {name: found for name, found in beyond.items() if found} == {}


@pytest.mark.parametrize("module", ALLOWED)
def test_who_may_does(module: str) -> None:
    allowed, reason = ALLOWED[module]
    assert sources(MODULES[module].read_text(encoding="utf-8")) == allowed, f"{module} {reason}"


def test_the_adviser_never_does() -> None:
    assert not any(name.startswith("pal_advisor") for name in ALLOWED)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("import time", {"time"}),
        ("import os, random as chance", {"random"}),
        ("from time import monotonic", {"time"}),
        ("from datetime import UTC, datetime", {"datetime"}),
        ("from hil.bridge.clock import MonotonicClock", {"MonotonicClock"}),
        ("import hil.bridge.clock\nclock = hil.bridge.clock.MonotonicClock()", {"MonotonicClock"}),
        ("def f():\n    import secrets", {"secrets"}),
        ("import os\nos.urandom(4)", {"urandom"}),
        ("from os import urandom", {"urandom"}),
        ("import numpy as np\nnp.random.default_rng()", {"default_rng()"}),
        ("import numpy as np\nnp.random.default_rng(seed)", set()),
        ("if TYPE_CHECKING:\n    from datetime import datetime", set()),
        ("if TYPE_CHECKING:\n    import time\nelse:\n    import random", {"random"}),
        ("from hil.bridge.clock import LastReading", set()),
        ("from .time import zone", set()),
    ],
)
def test_uses_are_found(text: str, found: set[str]) -> None:
    assert sources(text) == found
