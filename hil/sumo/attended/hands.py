"""A robot that somebody is about to touch, or has just let go of, and the wait for what a person says."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.errors import RefusedError
from hil.connecting.serving import WAIT
from hil.sumo.contest import COUNTDOWN

if TYPE_CHECKING:
    from hil.questions import Questions
    from hil.sumo.junior import Junior


def put_aside(junior: Junior) -> None:
    """Disarm a robot that somebody is about to touch.

    Args:
        junior: The robot.

    Raises:
        RefusedError: Its emergency stop is engaged, which disarming would end.
        PeerError: It does not answer.
    """
    _check_not_stopped(junior)
    junior.disarm()


def start_after_countdown(junior: Junior) -> None:
    """Arm a robot that somebody has just let go of; it stands still for the countdown of sumo rules.

    Args:
        junior: The robot.

    Raises:
        RefusedError: Its emergency stop is engaged.
        PeerError: It does not answer.
    """
    junior.arm()
    junior.wait(COUNTDOWN)


def wait_for_answer(junior: Junior, questions: Questions) -> str:
    """Wait until a question is answered; the link is served meanwhile.

    Args:
        junior: The robot.
        questions: The question is asked.

    Raises:
        RefusedError: The emergency stop was pressed.
    """
    while not (answer := questions.answer()):
        junior.step(WAIT)
        _check_not_stopped(junior)
    return answer


def _check_not_stopped(junior: Junior) -> None:
    if junior.stopped:
        raise RefusedError("to go on", "somebody pressed the emergency stop; disarm and arm the robot")
