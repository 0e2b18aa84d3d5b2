"""The console script `hil`: one file per sub-command."""

from hil.cli.app import main

__all__ = ["main"]
