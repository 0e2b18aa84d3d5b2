"""Reports on logs: a page and pictures."""

from hil.report.write import ReportFiles, write_report

__all__ = ["ReportFiles", "write_report"]
