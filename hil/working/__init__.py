"""Crews: processes of our own, or a Dask cluster, that share a computation."""

from hil.working.crew import Crew, open_crew
from hil.working.errors import WorkerError
from hil.working.processes import interruptible

__all__ = ["Crew", "WorkerError", "interruptible", "open_crew"]
