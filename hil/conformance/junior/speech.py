"""What a host says to a Junior: wheels, maneuvers, contests, and its memory."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Final, cast

from firmware_protocol.messages import (
    ContestCommand,
    JuniorContest,
    JuniorManeuver,
    JuniorManeuverResult,
    JuniorMemoryEntry,
    JuniorMemoryRead,
    JuniorMemoryWrite,
    JuniorWheels,
    ManeuverOption,
    Reason,
)
from firmware_protocol.vocabulary import ANY_STIMULUS, MAX_ACTIONS, Action
from hil.conformance.orders import named
from hil.conformance.registry import CheckFailedError, require
from hil.conformance.talk import Talk

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

BY_STIMULI: Final = 255
"""JUNIOR_MEMORY_READ.index: look up by the two stimuli."""
_MOTION: Final = ("SPD_FAST", "SPD_MODERATE", "SPD_SLOW", "SPD_TURN", "REFLEX_SPEED")


class JuniorSpeech(Talk):
    """A host that knows Junior's own messages.

    Attributes:
        memory_found: Maneuver memory as it was found; None where it could not be read, and must be left alone.
    """

    memory_found: list[JuniorMemoryEntry] | None = None

    def wheels(self, left: float, right: float, duration: float) -> JuniorWheels:
        """Turn the wheels; not sent."""
        return self.numbered(JuniorWheels, speed=(left, right), duration=duration)

    def maneuver(
        self, actions: Sequence[Action], period: float = 0.1, options: int = 0, sequence: int | None = None
    ) -> JuniorManeuver:
        """Perform actions; not sent."""
        return self.numbered(
            JuniorManeuver, sequence, period=period, options=int(options), count=len(actions), actions=_codes(actions)
        )

    def result(self, maneuver: JuniorManeuver, timeout: float, *, start: int = 0) -> JuniorManeuverResult:
        """Wait for the result of a maneuver, and acknowledge it."""
        return cast("JuniorManeuverResult", self.ended(maneuver, timeout, start=start))

    @contextmanager
    def still(self, **values: float) -> Iterator[None]:
        """Inside, no action and no reflex turns a wheel: their speeds are 0.

        Args:
            **values: Further parameters.
        """
        with self.parameters(**dict.fromkeys(_MOTION, 0.0), **values):
            yield

    def contest(self, command: ContestCommand, countdown: float = 0.0) -> JuniorContest:
        """Start or stop a contest; not sent."""
        return self.numbered(JuniorContest, command=int(command), countdown=countdown)

    # --- memory ------------------------------------------------------------------------------------------------------

    def write(
        self,
        actions: Sequence[Action],
        current: int,
        previous: int = ANY_STIMULUS,
        period: float = 0.25,
        options: int = ManeuverOption.EYES,
    ) -> JuniorMemoryWrite:
        """Store a maneuver; not sent."""
        return self.numbered(
            JuniorMemoryWrite,
            previous=previous,
            current=current,
            period=period,
            options=int(options),
            count=len(actions),
            actions=_codes(actions),
        )

    def erase(self, current: int = ANY_STIMULUS, previous: int = ANY_STIMULUS) -> JuniorMemoryWrite:
        """Erase a slot, or all where none is named; not sent."""
        return self.write((), current, previous, period=0.0, options=0)

    def read(self, index: int = BY_STIMULI, current: int = 0, previous: int = ANY_STIMULUS) -> JuniorMemoryEntry | None:
        """Read a slot by index, or by stimuli.

        Returns:
            The slot; None where there is none.
        """
        message = self.numbered(JuniorMemoryRead, index=index, previous=previous, current=current)
        start = len(self.heard)
        reason = self.request(message)
        if reason == Reason.NOT_FOUND:
            return None
        entries = [entry for entry in self.got(JuniorMemoryEntry, start) if entry.sequence == message.sequence]
        require(reason == Reason.NONE and entries, f"JUNIOR_MEMORY_READ was answered by {named(Reason, reason)}")
        return entries[0]

    def read_memory(self) -> list[JuniorMemoryEntry]:
        """Read all slots in use, in order."""
        entries: list[JuniorMemoryEntry] = []
        while len(entries) < BY_STIMULI and (entry := self.read(len(entries))) is not None:
            entries.append(entry)
        return entries

    def need_memory(self) -> None:
        """See that the memory can be put back as it was found.

        Raises:
            CheckFailedError: It could not be read.
        """
        require(self.memory_found is not None, "the memory could not be read, so it is left alone")

    @contextmanager
    def emptied_memory(self) -> Iterator[None]:
        """Inside, the memory is empty."""
        self.need_memory()
        try:
            self.expect(self.erase(), Reason.NONE, "that erases all")
            yield
        finally:
            self.fresh()
            self.restore_memory()

    def restore_memory(self) -> bool:
        """Write back the memory that was found.

        Returns:
            It is as it was; also where it could not be read, and was left alone.
        """
        found = self.memory_found
        if found is None:
            return True
        try:
            present = {_key(entry): _contents(entry) for entry in self.read_memory()}
            wanted = {_key(entry): _contents(entry) for entry in found}
            for previous, current in present.keys() - wanted.keys():
                self.request(self.erase(current, previous))
            for entry in found:
                if present.get(_key(entry)) != _contents(entry):
                    self.request(
                        self.numbered(
                            JuniorMemoryWrite,
                            previous=entry.previous,
                            current=entry.current,
                            period=entry.period,
                            options=entry.options,
                            count=entry.count,
                            actions=entry.actions,
                        )
                    )
            return [_contents(entry) for entry in self.read_memory()] == [_contents(entry) for entry in found]
        except CheckFailedError:
            return False


def _codes(actions: Sequence[Action]) -> tuple[int, ...]:
    return (*(int(action) for action in actions), *(0,) * (MAX_ACTIONS - len(actions)))


def _key(entry: JuniorMemoryEntry) -> tuple[int, int]:
    return entry.previous, entry.current


def _contents(entry: JuniorMemoryEntry) -> tuple[object, ...]:
    return (*_key(entry), entry.period, entry.options, entry.count, entry.actions)
