"""Lists the sub-commands of `hil swarm`."""

from __future__ import annotations

from hil.cli.verbs import Verb, VerbGroup, group_of


class SwarmVerbs(VerbGroup):
    """The verbs of `hil swarm`."""

    VERBS = (
        Verb(
            "surround",
            "hil.cli.swarm.surround:surround",
            "Let RANGERs learn to surround WILDs, and leave tables, log and report.",
        ),
        Verb(
            "identify",
            "hil.cli.swarm.robots:identify",
            "Have one micro-robot turn 20 degrees to the left and to the right, to see which it is.",
        ),
        Verb(
            "list",
            "hil.cli.swarm.robots:list_robots",
            "List the micro-robots on one link or several: they are only looked at, and go on with what they do.",
        ),
    )


app = group_of("swarm", SwarmVerbs, "Micro-robots: let a swarm of them, emulated or real, learn a task.")
