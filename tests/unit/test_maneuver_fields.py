"""Maneuvers and their reports as the wire has them, and back."""

from __future__ import annotations

import pytest

from firmware_protocol.events import Received
from firmware_protocol.maneuver_fields import from_fields, to_fields, to_report
from firmware_protocol.messages import JuniorManeuver, JuniorManeuverResult
from firmware_protocol.vocabulary import Action, Maneuver, Outcome, Stimulus
from firmware_protocol.wire.mavlink import MavlinkCodec

NOTHING = (0,) * 8


def result(*samples: int) -> JuniorManeuverResult:
    """A result as it comes over the wire."""
    sent = JuniorManeuverResult(
        session=7,
        sequence=1,
        samples=(*samples, *NOTHING[len(samples) :]),
        eye_left=(50, *NOTHING[1:]),
        eye_right=NOTHING,
        press_left=(0.0, 0.1, *(0.0,) * 6),
        press_right=(0.0,) * 8,
        travel=(0.01, None, *(0.0,) * 6),
        edges_left=(0, 1, *NOTHING[2:]),
        edges_right=NOTHING,
        target_system=255,
        target_component=190,
        outcome=0,
        reason=0,
        done=1,
        stimulus_before=3,
        stimulus_after=1,
    )
    (event,) = MavlinkCodec(system=255, component=190).receive(MavlinkCodec(system=1, component=1).encode(sent), 0.0)
    assert isinstance(event, Received)
    assert isinstance(event.message, JuniorManeuverResult)
    return event.message


@pytest.mark.parametrize("floor_reflex", [True, False])
@pytest.mark.parametrize("end_on_change", [True, False])
@pytest.mark.parametrize("arms", [True, False])
@pytest.mark.parametrize("hold", [True, False])
def test_a_maneuver_comes_back_as_it_was(floor_reflex: bool, end_on_change: bool, arms: bool, hold: bool) -> None:  # noqa: FBT001
    maneuver = Maneuver(
        (Action.FF, Action.L, Action.S),
        period=0.123,
        floor_reflex=floor_reflex,
        end_on_change=end_on_change,
        arms=arms,
        hold=hold,
    )
    fields = to_fields(maneuver)
    assert len(fields["actions"]) == 8
    assert from_fields(JuniorManeuver(1, 1, **fields, target_system=1, target_component=1)) == maneuver


def test_a_report_has_a_tally_for_every_action_begun() -> None:
    report = to_report(result(50, 30))
    assert [tally.samples for tally in report.tallies] == [50, 30]
    assert report.tallies[0].eyes == (50, 0)
    assert report.tallies[0].pressed_travel == pytest.approx(0.01)
    assert report.tallies[1].pressed_travel is None
    assert report.tallies[1].longest_press == pytest.approx((0.1, 0.0))
    assert (report.outcome, report.done) == (Outcome.COMPLETED, 1)
    assert report.before == Stimulus.EYE_LEFT | Stimulus.EYE_RIGHT
    assert to_report(result()).tallies == ()
