"""Makes the C headers of the messages from `dialect/junior.xml`, with pymavlink's mavgen, at build time.

They are never checked in. Used by setup.py and by the Makefile: `python headers.py [folder]`. It runs before the
package is installed and therefore imports nothing of it.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import sys
import tempfile
from pathlib import Path

FIRMWARE = Path(__file__).resolve().parent
DIALECT = FIRMWARE.parent / "dialect" / "junior.xml"
FOLDER = FIRMWARE / "_build" / "dialect"
LAST = Path("junior/mavlink.h")
"""The header that is moved into place last: when it is there, all are."""


def make_headers(folder: Path = FOLDER) -> Path:
    """Generate the headers unless they are there and newer than the dialect and this file.

    They are made elsewhere and moved into place when they are whole: neither an interruption nor another build at the
    same time leaves half of them.

    Args:
        folder: Where to, a folder of the name `dialect`; the headers go to `junior/` in it, mavgen's common ones next to that.

    Returns:
        The folder; the one that it is in goes on the include path.

    Raises:
        RuntimeError: pymavlink is not there, or mavgen refused the dialect; the text is what it said.
    """
    last = folder / LAST
    if last.exists() and last.stat().st_mtime >= max(path.stat().st_mtime for path in (DIALECT, Path(__file__))):
        return folder
    try:
        mavgen = importlib.import_module("pymavlink.generator.mavgen")
    except ImportError as error:
        raise RuntimeError(f"making the message headers needs pymavlink: {sys.executable} -m pip install pymavlink") from error
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as name:
        made = Path(name)
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            done = mavgen.mavgen(mavgen.Opts(name, wire_protocol="2.0", language="C", validate=False), [str(DIALECT)])
        if not done:
            raise RuntimeError(f"mavgen could not read {DIALECT}: {said.getvalue()}")
        paths = sorted(path.relative_to(made) for path in made.rglob("*.h"))
        for path in sorted(paths, key=LAST.__eq__):
            (folder / path).parent.mkdir(exist_ok=True)
            (made / path).replace(folder / path)
    last.touch()
    return folder


if __name__ == "__main__":
    make_headers(*(Path(argument) for argument in sys.argv[1:2]))
