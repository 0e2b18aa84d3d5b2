"""Reports on logs: a page and pictures."""

from hil.report.write import PAGE, ReportFiles, write_report

__all__ = ["PAGE", "ReportFiles", "write_report"]
