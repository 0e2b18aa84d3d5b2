"""Puts Junior and the core together as a library for the Arduino IDE and PlatformIO: `python library.py [folder]`.

The message headers in it are made by mavgen, which is why the library is assembled and not checked in. It runs without the
package being installed and imports nothing of it.
"""

from __future__ import annotations

import runpy
import shutil
import sys
import tempfile
from pathlib import Path

FIRMWARE = Path(__file__).resolve().parent
NAME = "JuniorHIL"
ROLE = "junior"
"""Folder of the role that is in it."""


def make_library(folder: Path = FIRMWARE / "_build") -> Path:
    """Assemble the library, in place of an older one.

    Args:
        folder: Where to.

    Returns:
        The library: what is put into the IDE's folder `libraries`, or named in PlatformIO's `lib_deps`.

    Raises:
        RuntimeError: The message headers could not be made; the text says why.
    """
    folder.mkdir(parents=True, exist_ok=True)
    library = folder / NAME
    if library.exists():
        shutil.rmtree(library)
    source = library / "src"
    shutil.copytree(FIRMWARE / "targets" / "arduino", library)
    source.mkdir()
    headers = runpy.run_path(str(FIRMWARE / "headers.py"))
    (library / "JuniorHIL.h").replace(source / "JuniorHIL.h")
    for name in ("core", ROLE):
        shutil.copytree(FIRMWARE / name, source / name)
    roles = (FIRMWARE / "roles.h").read_text(encoding="utf-8")
    (source / "roles.h").write_text(f"/* The only role in this library. */\n#define ROLE {ROLE}\n\n{roles}", encoding="utf-8")
    with tempfile.TemporaryDirectory(dir=folder) as made:
        shutil.copytree(headers["make_headers"](Path(made) / "dialect"), source / "dialect")
    shutil.copyfile(FIRMWARE.parents[1] / "LICENSE", library / "LICENSE")
    return library


if __name__ == "__main__":
    made = make_library(*(Path(name) for name in sys.argv[1:2]))
    archive = shutil.make_archive(str(made), "zip", made.parent, made.name)
    sys.stdout.write(f"{made}\n{archive}\n")
