"""Reports on logs: a page and pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hil.report.write import PAGE, ReportFiles, write_report

__all__ = ["PAGE", "ReportFiles", "write_report"]


def __getattr__(name: str) -> Any:  # noqa: ANN401 - whatever is asked for
    """What draws is loaded when it is first asked for: it takes half a second, and what gathers needs none of it."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from hil.report import write  # noqa: PLC0415 - see above

    return getattr(write, name)
