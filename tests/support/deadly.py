"""Evaluations at which workers die; here, since workers must be able to import them."""

from __future__ import annotations

import os
import signal

from hil.swarm.missions.evolving.evaluation import EvaluationResult, EvaluationTask, evaluate

DEADLY = "B2C1D2L1R6S1W2"
"""The book's winner, with few robots: it is run last."""


def die_at_the_last(task: EvaluationTask) -> EvaluationResult:
    """Play as ever, but die at one condition whoever plays it."""
    if str(task.case) == DEADLY:
        os.kill(os.getpid(), signal.SIGKILL)
    return evaluate(task)
