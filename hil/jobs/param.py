"""A robot's parameters: listed, read, written, loaded."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Final

from hil.connecting.handle import RobotHandle
from hil.files.parameter_loading import Wanted, load, parameters_of, shortest
from hil.jobs.options import none_or
from hil.jobs.session import open_session
from hil.jobs.words import nothing
from pal_advisor.fields import Fields

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Self

    from hil.jobs.stage import Stage

PARAMETERS: Final = "parameters.toml"
GREATEST: Final = 3.5e38
"""No parameter has a greater value: they have 32 bits."""


@dataclass(frozen=True)
class ParamJob:
    """Parameters to be read or written.

    Attributes:
        name: Which one; None is all.
        value: Its new value; None reads it.
        wanted: What is to be loaded; None where nothing is.
        everything: Loading sets the robot's identity too.
        tell: Is told what changes and is left out.
        warn: Is told what was put back, or could not be.
    """

    VERB: ClassVar[str] = "param"

    name: str | None
    value: float | None
    wanted: Wanted | None
    everything: bool
    tell: Callable[[str], None] = field(default=nothing, compare=False)
    warn: Callable[[str], None] = field(default=nothing, compare=False)

    @property
    def seed(self) -> int:
        """Nothing is drawn."""
        return 0

    @property
    def reconnect(self) -> float:
        """A robot that is lost is not waited for, in s."""
        return 0.0

    def options(self) -> dict[str, Any]:
        """Everything that decides, but for what is to be loaded."""
        return {"name": self.name, "value": self.value, "everything": self.everything}

    def files(self) -> dict[str, bytes]:
        """What is to be loaded."""
        return {} if self.wanted is None else {PARAMETERS: self.wanted.text.encode()}

    @classmethod
    def of_log(cls, options: Fields, files: Mapping[str, bytes]) -> Self:
        """As a log has it; see `Job.of_log`."""
        everything = options.flag("everything")
        loaded = files.get(PARAMETERS)
        return cls(
            name=none_or(options, "name", Fields.text),
            value=none_or(options, "value", lambda fields, name: fields.number(name, -GREATEST, GREATEST)),
            wanted=None if loaded is None else parameters_of(loaded, PARAMETERS, everything=everything),
            everything=everything,
        )

    def perform(self, stage: Stage) -> dict[str, int | float]:
        """Read or write them; what is in force then."""
        with open_session(RobotHandle, stage, arm=False) as session:
            robot = session.robot
            if self.name is not None:
                now = robot.parameter(self.name) if self.value is None else robot.set_parameter(self.name, self.value)
                found = {self.name: now}
            elif self.wanted is not None:
                found = load(robot, self.wanted, tell=self.tell, warn=self.warn)
            else:
                found = robot.parameters()
            result = {key: shortest(number) for key, number in found.items()}
            session.finish({"parameters": result})
        return result
