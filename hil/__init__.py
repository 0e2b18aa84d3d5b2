"""The bridge: connects, coaches, records, replays, shows.

`connect` opens a robot, real or emulated; the rest are the types it deals in.
"""

from firmware_protocol.maneuver_fields import ManeuverReport
from firmware_protocol.vocabulary import Action, Maneuver, Outcome, Stimulus
from hil.connect import connect
from hil.junior import Junior
from hil.safety import Limits

__all__ = ["Action", "Junior", "Limits", "Maneuver", "ManeuverReport", "Outcome", "Stimulus", "connect"]
