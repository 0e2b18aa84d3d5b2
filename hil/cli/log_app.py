"""Lists the sub-commands of `hil log`."""

from __future__ import annotations

from hil.cli.verbs import Verb, VerbGroup, group_of


class LogVerbs(VerbGroup):
    """The verbs of `hil log`."""

    VERBS = (
        Verb("info", "hil.cli.log:info", "Tell what is in a log: how long, which topics, how often, how large."),
        Verb(
            "check",
            "hil.cli.log:check",
            "Check a log against MCAP's rules, and one of this program against its own; exit status 1 where one is broken.",
        ),
        Verb(
            "recover",
            "hil.cli.log:recover_log",
            "Make a whole log of all that can be read of a damaged one, or of one that was cut off.",
        ),
        Verb("slim", "hil.cli.log:slim_log", "Make a log small: what running it again needs, and no more."),
        Verb("viewers", "hil.cli.log_viewers:viewers", "Say how to open a log in Foxglove, Lichtblick and Rerun."),
        Verb("csv", "hil.cli.log_tables:csv", "Write a table of each topic: a line for each entry, a column for each field."),
        Verb(
            "diff",
            "hil.cli.log_tables:diff",
            "Tell what differs between two logs, by topic and field; exit status 1 where anything does.",
        ),
    )


app = group_of(
    "log", LogVerbs, "Look into logs: what is in one, whether it is in order; make it whole, small, or tables; compare two."
)
