"""The options of all verbs, as a shell is told them; as a program, writes them to where the command line reads them.

python tests/support/completion_table.py
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from hil.cli import completion
from hil.cli.app import Verbs
from hil.cli.emulating import Emulated
from hil.cli.log_app import LogVerbs
from hil.cli.swarm.app import SwarmVerbs

PLACE = Path(completion.__file__).with_name("completion.json")


def table() -> str:
    """All verbs by where they are, with a line for each option."""
    verbs = [verb for group in (Verbs, Emulated, LogVerbs, SwarmVerbs) for verb in group.VERBS]
    blocks = []
    for verb in sorted(verbs, key=lambda verb: verb.home):
        if verb.home.endswith(":app"):
            continue
        command = verb.load()
        context = command.make_context("hil", [], resilient_parsing=True)
        rows = [json.dumps(_row(parameter, context)) for parameter in command.params]
        blocks.append(f" {json.dumps(verb.home)}: [\n  " + ",\n  ".join(rows) + "\n ]")
    return "{\n" + ",\n".join(blocks) + "\n}\n"


def _row(parameter: Any, context: Any) -> dict[str, object]:  # noqa: ANN401 - typer brings a click of its own, or not
    """An option or an argument; what is left out is false, or empty."""
    option = parameter.param_type_name == "option"
    row: dict[str, object] = {"names": _names(parameter) if option else []}
    if option:
        row["help"] = parameter.help
        if parameter.is_flag:
            row["flag"] = True
    if parameter.nargs != 1 or getattr(parameter, "multiple", False):
        row["many"] = True
    if completion.LINKS in str(getattr(parameter, "metavar", "")).split("|"):
        row["words"] = completion.LINKS
    elif words := [item.value for item in parameter.shell_complete(context, "") if item.type == "plain"]:
        row["words"] = words
    return row


def _names(parameter: Any) -> list[str]:  # noqa: ANN401 - as above
    """Names of an option as typer is told them: what switches off behind what switches on."""
    if not parameter.secondary_opts:
        return list(parameter.opts)
    return [f"{on}/{off}" for on, off in zip(parameter.opts, parameter.secondary_opts, strict=True)]


if __name__ == "__main__":
    PLACE.write_text(table(), encoding="utf-8")
