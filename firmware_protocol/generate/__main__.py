"""`python -m firmware_protocol.generate [--check | --golden]`."""

from __future__ import annotations

import argparse
import sys

from firmware_protocol.generate.outputs import GOLDEN, OUTPUTS, ROOT, stale


def main(arguments: list[str] | None = None) -> int:
    """Write the generated files, or say which are out of date.

    Args:
        arguments: Command line without the program's name; None takes the process's own.

    Returns:
        Exit status: 0 done or up to date, 1 out of date.
    """
    parser = argparse.ArgumentParser(prog="python -m firmware_protocol.generate", description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing; exit with 1 if a file is out of date")
    parser.add_argument("--golden", action="store_true", help="write the golden vectors anew: the protocol has been changed")
    options = parser.parse_args(arguments)
    old = stale()
    for name in old:
        if options.check:
            sys.stderr.write(f"{name} is out of date: run python -m firmware_protocol.generate\n")
        else:
            path = ROOT / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(OUTPUTS[name](), encoding="utf-8")
            sys.stdout.write(f"wrote {name}\n")
    if options.golden:
        for name, make in GOLDEN.items():
            (ROOT / name).parent.mkdir(parents=True, exist_ok=True)
            (ROOT / name).write_bytes(make())
            sys.stdout.write(f"wrote {name}\n")
    return 1 if options.check and old else 0


if __name__ == "__main__":
    sys.exit(main())
