"""`python -m hil.book [--check]`: make docs/what-holds.md of the stored results, or see that it is up to date."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.errors import HilError
from hil.book.page import what_holds
from hil.book.places import PAGE, RESULTS
from hil.book.results import StoredResults
from hil.files.outputs import replace_file

if TYPE_CHECKING:
    from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Make the page, or say that it is out of date.

    Args:
        arguments: Command line without the program's name; None takes the process's own.

    Returns:
        Exit status: 0 made or up to date, 1 out of date, or a result can't be read.
    """
    parser = argparse.ArgumentParser(prog="python -m hil.book", description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing; exit with 1 if the page is out of date")
    parser.add_argument("--results", type=Path, default=RESULTS, metavar="FOLDER", help="where results are stored")
    parser.add_argument("--page", type=Path, default=PAGE, metavar="FILE", help="the page")
    options = parser.parse_args(arguments)
    try:
        text = what_holds(StoredResults(options.results))
        if not options.check:
            replace_file(options.page, text.encode())
            sys.stdout.write(f"wrote {options.page}\n")
        elif not options.page.is_file() or options.page.read_text(encoding="utf-8") != text:
            sys.stderr.write(f"{options.page} is out of date: run python -m hil.book\n")
            return 1
    except (HilError, OSError) as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
