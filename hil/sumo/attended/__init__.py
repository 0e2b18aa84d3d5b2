"""Rings without a referee, and who is beside them: a person who judges, pauses or changes the battery; or nobody.

What a person would see of the robot before it is coached, too: whether its wheels are even.
"""

from hil.sumo.attended.evenness import Evenness, try_wheels
from hil.sumo.attended.floor import FloorJudge
from hil.sumo.attended.judged import JudgedRing
from hil.sumo.attended.lonely import LonelyRing
from hil.sumo.attended.paused import PausedRing
from hil.sumo.attended.powered import PoweredRing

__all__ = ["Evenness", "FloorJudge", "JudgedRing", "LonelyRing", "PausedRing", "PoweredRing", "try_wheels"]
