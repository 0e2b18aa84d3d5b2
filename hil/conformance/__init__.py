"""Conformance: named checks of the whole protocol, against any robot over any link."""

from hil.conformance.registry import Check
from hil.conformance.runner import CheckOutcome, Verdict, for_role, on_wire, perform
from hil.conformance.subject import Subject
from hil.conformance.suite import CHECKS, LAST

__all__ = ["CHECKS", "LAST", "Check", "CheckOutcome", "Subject", "Verdict", "for_role", "on_wire", "perform"]
