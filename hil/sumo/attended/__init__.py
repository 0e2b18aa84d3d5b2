"""Rings without a referee, and who is beside them: a person who judges, pauses or changes the battery; or nobody."""

from hil.sumo.attended.floor import FloorJudge
from hil.sumo.attended.judged import JudgedRing
from hil.sumo.attended.lonely import LonelyRing
from hil.sumo.attended.paused import PausedRing
from hil.sumo.attended.powered import PoweredRing

__all__ = ["FloorJudge", "JudgedRing", "LonelyRing", "PausedRing", "PoweredRing"]
