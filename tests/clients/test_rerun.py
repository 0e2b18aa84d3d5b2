"""Rerun takes a log of ours, whole or cut off, and the blueprint that the package holds."""

from __future__ import annotations

import shlex
import subprocess
from pathlib import Path

import pytest

from hil.cli.log_viewers import rerun_commands
from hil.look.viewers.layouts import blueprint_for

pytest_plugins = ["client_fixtures"]
pytestmark = pytest.mark.clients

LOG = Path(__file__).parents[1] / "golden" / "small.mcap"


@pytest.mark.parametrize("cut", [0, 3000])
def test_rerun_takes_the_log_and_the_blueprint(clients: Path, tmp_path: Path, cut: int) -> None:
    log = tmp_path / "log.mcap"
    log.write_bytes(LOG.read_bytes()[: -cut or None])
    blueprint = blueprint_for([])
    convert, _ = rerun_commands(log, blueprint, 1_795_890_398_500_000_000, whole=not cut)
    rerun = clients / "bin" / "rerun"
    for command in (shlex.split(convert), ["rerun", "rrd", "verify", str(log.with_suffix(".rrd")), str(blueprint)]):
        subprocess.run([rerun, *command[1:]], check=True, capture_output=True)  # noqa: S603
    told = subprocess.run(  # noqa: S603
        [rerun, "rrd", "print", str(log.with_suffix(".rrd"))], check=True, capture_output=True, text=True
    ).stdout
    assert "/junior/sensors - data columns: [hil.JuniorSensors:message]" in told
    assert "Points3D:positions" in told
