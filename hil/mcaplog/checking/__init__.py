"""Whether a log is as the MCAP specification demands, and as logs of ours are."""

from hil.mcaplog.checking.rules import CheckedLog, CheckedRule, Finding, check_log

__all__ = ["CheckedLog", "CheckedRule", "Finding", "check_log"]
