"""Makes the C headers of the messages from `dialect/junior.xml`, with pymavlink's mavgen, at build time.

They are never checked in. Used by setup.py and by the Makefile: `python headers.py [folder]`. It runs before the
package is installed and therefore imports nothing of it.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import sys
from pathlib import Path

FIRMWARE = Path(__file__).resolve().parent
DIALECT = FIRMWARE.parent / "dialect" / "junior.xml"
FOLDER = FIRMWARE / "_build"


def make_headers(folder: Path = FOLDER) -> Path:
    """Generate the headers unless they are there and newer than the dialect.

    Args:
        folder: Where to; the headers go to `junior/` in it, mavgen's common ones next to that.

    Returns:
        The folder, to be put on the include path.

    Raises:
        RuntimeError: mavgen refused the dialect; the text is what it said.
    """
    stamp = folder / "junior" / "mavlink.h"
    if stamp.exists() and stamp.stat().st_mtime >= DIALECT.stat().st_mtime:
        return folder
    folder.mkdir(parents=True, exist_ok=True)
    mavgen = importlib.import_module("pymavlink.generator.mavgen")
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        done = mavgen.mavgen(mavgen.Opts(str(folder), wire_protocol="2.0", language="C", validate=False), [str(DIALECT)])
    if not done:
        raise RuntimeError(f"mavgen could not read {DIALECT}: {said.getvalue()}")
    stamp.touch()
    return folder


if __name__ == "__main__":
    make_headers(*(Path(argument) for argument in sys.argv[1:2]))
