"""The errors of this package.

    HilError                            everything we raise on purpose
     ├── LinkError                      something about a link; `url` says which
     │    ├── LinkOpenError             could not be opened (no such port, busy, not allowed): `reason` and `remedy`
     │    │    └── AddressError(ValueError)  the URL is not one we understand
     │    ├── LinkClosedError           was open and is gone (unplugged, reset, peer closed)
     │    └── LinkTimeoutError          nothing came in the time allowed
     ├── PeerError                      something about the robot at the other end
     │    ├── NoRobotError              nobody answered as a robot
     │    ├── VersionError              it speaks a protocol we do not
     │    ├── PeerLostError             it answered and then fell silent, restarted, or its link went away for a while
     │    │    └── PeerGoneError        and it was waited for in vain
     │    ├── WrongRoleError            it is of another kind than what was asked for is for
     │    ├── WrongRobotError           another robot answers in the place of the one that was lost
     │    └── RefusedError              it refused a command: `reason`
     ├── FirmwareBuildError(ImportError)  the emulated robot's firmware was built from other sources: install again
     ├── PhysicsVersionError(ImportError)  the physics engine is of a version that the emulation was not made for
     ├── FaultSpecError(ValueError)     a fault specification with something wrong in it: `path`
     └── EncodeError(ValueError)        a message of our own that the wire cannot carry

What comes from the wire never raises: damaged or foreign input becomes a `Rejected` event.
Example: a robot is unplugged while it performs a maneuver. The link raises `LinkClosedError` in the pump, the
bridge reports it as an event, and the handle raises `LinkClosedError` to the caller. Where the bridge may open the link
again it raises `PeerLostError`, and `LinkClosedError` only when its patience is over: then `hil coach` writes its
checkpoint and exits with status 3.
"""

from __future__ import annotations


class HilError(Exception):
    """Base of every error raised on purpose; its text is fit to be shown to a person."""

    def __reduce__(self) -> tuple[object, ...]:
        """It goes from one process to another as it is, whatever it was made of."""
        return _remade, (type(self), self.args, self.__dict__)


def _remade(kind: type[HilError], args: tuple[object, ...], state: dict[str, object]) -> HilError:
    error = kind.__new__(kind)
    error.args = args
    error.__dict__.update(state)
    return error


class LinkError(HilError):
    """Something about a link.

    Attributes:
        url: Address of the link.
    """

    def __init__(self, url: str, message: str) -> None:
        super().__init__(f"{url}: {message}")
        self.url = url


def bare_text(error: LinkError) -> str:
    """What an error of a link says, without the address.

    Args:
        error: The error.
    """
    return str(error).removeprefix(f"{error.url}: ")


class LinkOpenError(LinkError):
    """The link could not be opened.

    Attributes:
        reason: What happened.
        remedy: What to do next; may be empty.
    """

    def __init__(self, url: str, reason: str, remedy: str = "") -> None:
        super().__init__(url, f"{reason}. {remedy}" if remedy else reason)
        self.reason = reason
        self.remedy = remedy


class AddressError(LinkOpenError, ValueError):
    """The URL is not one we understand."""


class LinkClosedError(LinkError):
    """The link was open and is gone."""


class LinkTimeoutError(LinkError):
    """Nothing came in the time allowed."""


class PeerError(HilError):
    """Something about the robot at the other end."""


class NoRobotError(PeerError):
    """Nobody answered as a robot."""


class VersionError(PeerError):
    """The robot speaks a version of the protocol that we do not."""


class WrongRoleError(PeerError):
    """The robot has another role than what it was to be used for needs."""


class PeerLostError(PeerError):
    """The robot answered, and then it fell silent or restarted, or its link went away: what was asked may be done or not."""


class PeerGoneError(PeerLostError):
    """A robot that was lost has not come back in the time it was waited for."""


class WrongRobotError(PeerError):
    """Another robot, with another unique id, answers in the place of the one that was lost."""


class RefusedError(PeerError):
    """The robot refused a command.

    Attributes:
        command: What was asked.
        reason: Why not, in words.
    """

    def __init__(self, command: str, reason: str) -> None:
        super().__init__(f"the robot refused {command}: {reason}")
        self.command = command
        self.reason = reason


class FirmwareBuildError(HilError, ImportError):
    """The build of the firmware that emulated robots run does not fit the rest of the package: it has to be made again."""


class PhysicsVersionError(HilError, ImportError):
    """The physics engine that is installed is not as the emulation's kernel needs it; the text says what to install."""


class FaultSpecError(HilError, ValueError):
    """A fault specification has something wrong in it.

    Attributes:
        path: The field, as `stuck[1].sensor`, where it was read from a table; may be empty.
    """

    def __init__(self, message: str, path: str = "") -> None:
        super().__init__(message)
        self.path = path


class EncodeError(HilError, ValueError):
    """A message of our own that the wire cannot carry: a field is out of range or of the wrong length."""
