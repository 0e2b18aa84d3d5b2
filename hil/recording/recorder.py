"""The recorder of the robots' sessions: what passes the bridge, and above it what the run has to say."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.recording.drawing import Drawings
from hil.recording.sumo_drawing import SumoDrawing
from hil.recording.sumo_log import SumoLog
from hil.recording.swarm_drawing import SwarmDrawing
from hil.recording.swarm_log import SwarmLog
from hil.recording.wire_log import WireLog

if TYPE_CHECKING:
    from hil.bridge.taps import Tap
    from hil.recording.drawing import Drawing


class Recorder(WireLog, SumoLog, SwarmLog):
    """Writes everything that passes the bridge, and what the learner does, into a log, with pictures of the robot.

    Made and left as a `WireLog` is.
    """

    def _make_drawing(self) -> Drawing:
        self._swarm = SwarmDrawing(self._writer)
        return Drawings(SumoDrawing(self._writer), self._swarm)

    def of_network(self, name: str) -> Tap:
        """See `WireLog.of_network`. A swarm on several networks is not drawn: a message does not say of which one it is."""
        self._swarm.draws = False
        return super().of_network(name)
