"""The plain install has all that is needed but what draws: runs and reports do without, and say what to install."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from importlib.util import find_spec
from pathlib import Path

import pytest

from hil.report.style import INSTALL

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_what_draws_is_an_extra_and_part_of_the_developers() -> None:
    plain = {requirement.partition(">")[0] for requirement in PROJECT["dependencies"]}
    assert {"python-can", "msgpack", "pyserial", "mcap"} <= plain
    assert not plain & {"matplotlib", "foxglove-sdk", "gymnasium"}
    extras = PROJECT["optional-dependencies"]
    assert f"pip install '{extras['report'][0]}'" == INSTALL
    assert "junior-hil[foxglove,gym,report]" in extras["dev"]
    assert extras["distributed"] == ["distributed>=2024.12"], "the message in hil.working.cluster names it"


def without(package: str, folder: Path) -> dict[str, str]:
    """An environment in which a package that is installed is not found, by this program and those that it starts.

    Args:
        package: The package.
        folder: Where to make what that takes.
    """
    spec = find_spec(package)
    assert spec is not None, f"{package} is one of the developers' packages"
    assert spec.origin is not None
    installed, others = Path(spec.origin).parent.parent, folder / "packages"
    others.mkdir()
    for one in installed.iterdir():
        if one.name.partition("-")[0] != package:
            (others / one.name).symlink_to(one)
    program = f"import sys\nsys.path[:] = [{str(others)!r} if one == {str(installed)!r} else one for one in sys.path]\n"
    (folder / "sitecustomize.py").write_text(program, encoding="utf-8")
    path = os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH")])])
    return {**os.environ, "PYTHONPATH": path}


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="links to packages are made")
def test_without_what_draws_a_report_has_all_but_pictures_and_one_line_says_how_to_have_them(tmp_path: Path) -> None:
    environment = without("matplotlib", tmp_path)

    def hil(*arguments: str) -> tuple[str, str]:
        done = subprocess.run(  # noqa: S603 - our own program
            [sys.executable, "-m", "hil", *arguments], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
        )
        return done.stdout, done.stderr

    said, errors = hil("coach", "--runs", "1", "--budget", "40", "--held-out", "2", "--out", "run")
    (line,) = [line for line in said.splitlines() if "pictures" in line]
    assert INSTALL in line
    assert errors == ""
    page = (tmp_path / "run" / "report" / "report.html").read_text(encoding="utf-8")
    assert "<table>" in page
    assert "<img" not in page
    assert "matplotlib is not installed" in page
    said, errors = hil("report", "run", "--overwrite", "--quiet")
    assert (said.strip(), errors) == ("run/report/report.html", "")
    said, errors = hil("report", "run", "--overwrite")
    assert INSTALL in errors
    hil("bout", "--controller", "chase", "--trials", "1", "--no-log")
