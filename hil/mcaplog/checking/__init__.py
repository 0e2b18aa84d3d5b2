"""Whether a log is as the MCAP specification demands, and as logs of ours are."""

from hil.mcaplog.checking.rules import CheckedLog, CheckedRule, Violation, check_log

__all__ = ["CheckedLog", "CheckedRule", "Violation", "check_log"]
