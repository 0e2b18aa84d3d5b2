"""No module needs, to be loaded or to be used, one that needs it; only for its types it may."""

from __future__ import annotations

from graphlib import CycleError, TopologicalSorter

import grimp

PACKAGES = ("firmware_protocol", "hil", "pal_advisor", "simdevice")


def test_imports_go_round_in_no_circle() -> None:
    graph = grimp.build_graph(*PACKAGES, exclude_type_checking_imports=True)
    needed = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    assert sum(map(len, needed.values())) > 1000
    circle: list[str] = []
    try:
        TopologicalSorter(needed).prepare()
    except CycleError as error:
        circle = error.args[1]
    assert not circle, "each of these is imported by the next one"
