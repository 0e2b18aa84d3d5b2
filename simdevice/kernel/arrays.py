"""The kernel's arrays for some rings, and its loop over all of them; see `world.h`, `devices.h`, `referee.h`, `loop.h`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Protocol, cast

from simdevice.boards import board_host
from simdevice.kernel.chipmunk import FUNCTIONS

if TYPE_CHECKING:
    from simdevice.boards import Host

PIECES: Final = 2
"""Of a ring: Junior is its first, the opponent its second."""
SENSORS: Final = 6
"""Of a Junior: eyes, floor sensors, arms."""
MANY: Final = 2**24 - 1
"""Control periods: the most that can be asked of the loop at a time."""
ANY_ROOM: Final = 2**32 - 1
_WHY: Final = 56
_LIVED: Final = 32
_LENGTH: Final = 2**32 - 1
"""Where in the loop's answer it says why it came back, and how many periods were lived; what of it are bytes said."""
_WORDS: Final = 4096
"""Bytes that a ring says at most in a control period, its referee's answers apart."""


class KernelLibrary(Protocol):
    """What the kernel can do; `loop.h` and `world.h` tell."""

    KERNEL_DUMMY: int
    KERNEL_ROVER: int
    KERNEL_SAID: int
    KERNEL_DUE: int
    KERNEL_NOISE: int
    KERNEL_SECOND: int

    def kernel_asked(self, loop: object, rx: bytes, rx_len: int) -> int:
        """Something may be meant for a referee."""
        ...

    def kernel_run(self, loop: object, rx: bytes, rx_len: int, periods: int) -> int:
        """Live for at most so many control periods."""
        ...

    def kernel_physics_alone(self, loop: object, periods: int) -> None:
        """Step the physics and nothing else."""
        ...

    def world_command(self, world: object, piece: int, left: int, right: int) -> None:
        """Set a Junior's wheels, in permille."""
        ...

    def world_power_on(self, world: object, piece: int) -> None:
        """A Junior's board boots."""
        ...

    def world_forget(self, world: object, piece: int) -> None:
        """A Junior has seen and touched nothing."""
        ...


class Ringside(Protocol):
    """What of a ring is still Python's business: now and then the loop asks."""

    def answer(self, inbound: bytes) -> None:
        """Let its referee look at what has arrived, and see to it that the answer follows."""
        ...

    def draw(self) -> None:
        """See that its Juniors have noise for a control period."""
        ...

    def report(self) -> bytes:
        """What its referee reports; it is due."""
        ...


class Attended(Protocol):
    """A ring that wants to be asked before control periods.

    Attributes:
        number: Which it is.
    """

    number: int

    def begin(self) -> int:
        """Control periods begin. Returns how many may pass before it is to be asked again, 1 or more."""
        ...

    def skip(self, periods: int) -> None:
        """So many control periods, 1 or more, have passed since."""
        ...


class Watched(Protocol):
    """A ring whose table somebody holds on to."""

    def take_robots(self) -> None:
        """Take over how everybody stands, before control periods."""
        ...

    def show_robots(self) -> None:
        """Show how everybody stands, after them."""
        ...


class Arrays:
    """Rings in arrays, and the loop that lets all of them live.

    Args:
        count: How many rings.

    Attributes:
        ffi: Makes the C structs.
        lib: The kernel's functions and constants.
        world: The struct `kernel_world`.
        devices: The struct `kernel_devices`.
        referees: The struct `kernel_referees`.
        loop: The struct `kernel_loop`.
        rings: Each ring's Python side, by number.
        run: The kernel's loop itself.
        attended: Those that are to be asked before control periods.
        watched: Those whose tables somebody holds on to.
    """

    def __init__(self, count: int) -> None:
        host: Host = board_host()
        self.ffi = ffi = host.ffi
        self.lib = cast("KernelLibrary", host.lib)
        self._count = count
        self._kept: list[object] = []
        self.world, self.devices = self._made("kernel_world"), self._made("kernel_devices")
        self.referees, self.loop = self._made("kernel_referees"), self._made("kernel_loop")
        self.rings: list[Ringside] = []
        self.attended: list[Attended] = []
        self.watched: list[Watched] = []
        loop = self.loop
        loop.world, loop.devices, loop.referees, loop.rings = self.world, self.devices, self.referees, count
        self.world.pieces = PIECES
        for field, address in FUNCTIONS.items():
            setattr(self.world.physics, field, ffi.cast(ffi.typeof(getattr(self.world.physics, field)), address))
        for number in range(count):
            loop.living[number] = loop.plugged[number] = 1
            loop.room[number] = ANY_ROOM
        self._make_room(0)
        self.run, self._asked, self._unpack = self.lib.kernel_run, self.lib.kernel_asked, ffi.unpack
        self._due, self._noise = self.lib.KERNEL_DUE << _WHY, self.lib.KERNEL_NOISE << _WHY

    def _made(self, name: str) -> Any:  # noqa: ANN401 - a struct of cffi
        """A struct whose pointers point to arrays, all zero, that are long enough for whatever they hold of a ring."""
        ffi = self.ffi
        struct = ffi.new(f"{name} *")
        self._kept.append(struct)
        for field, kind in ffi.typeof(name).fields:
            if kind.type.kind == "pointer" and kind.type.item.kind != "struct":
                array = ffi.new(ffi.getctype(kind.type.item, "[]"), self._count * PIECES * SENSORS)
                self._kept.append(array)
                setattr(struct, field, array)
        return struct

    def _make_room(self, more: int) -> None:
        """Have room for all that is said in a control period, and so many bytes besides."""
        self._room = more
        self._said = self.loop.said = self.ffi.new("uint8_t[]", self._count * _WORDS + more)
        self._words = self.ffi.cast("char *", self._said)

    def live(self, inbound: bytes, periods: int) -> bytes:
        """Let all rings live for at most so many control periods, until there is something to see to.

        Args:
            inbound: What has arrived at all Juniors.
            periods: How many, 1 or more.

        Returns:
            All that has been said in the last of them.
        """
        if self.watched:
            for ring in self.watched:
                ring.take_robots()
            said = self._live(inbound, periods)
            for ring in self.watched:
                ring.show_robots()
            return said
        return self._live(inbound, periods)

    def _live(self, inbound: bytes, periods: int) -> bytes:
        """The same, where nobody sees the tables."""
        if inbound and self._asked(self.loop, inbound, len(inbound)):
            self._answer(inbound)
        while True:
            why = self._run_attended(inbound, periods) if self.attended else self.run(self.loop, inbound, len(inbound), periods)
            length = why & _LENGTH
            if why & self._due:
                return self._with_reports(length)
            if length:
                return self._unpack(self._words, length)  # type: ignore[no-any-return]
            if not why & self._noise:
                return b""
            self.draw()
            if lived := why >> _LIVED & MANY:
                periods -= lived
                inbound = b""

    def _run_attended(self, inbound: bytes, periods: int) -> int:
        """Run the loop where some are to be asked before."""
        attended = [one for one in self.attended if self.loop.living[one.number]]
        most = min([periods, *[one.begin() for one in attended]])
        why = self.run(self.loop, inbound, len(inbound), most)
        while not (lived := why >> _LIVED & MANY):  # without noise nobody has lived at all
            self.draw()
            why = self.run(self.loop, inbound, len(inbound), most)
        for one in attended:
            one.skip(lived)
        return why if why >> _WHY or lived == periods else why | self._noise  # not over yet: as where only noise is lacking

    def _stopped(self, why: int) -> list[int]:
        """Numbers of the rings in whose `stop` this is."""
        return [number for number, stop in enumerate(self._unpack(self.loop.stop, self._count)) if stop & why]

    def _answer(self, inbound: bytes) -> None:
        """Let the referees look that may be meant."""
        for number in self._stopped(0xFF):
            self.rings[number].answer(inbound)
        answers = sum(self._unpack(self.loop.answer_len, self._count))
        if answers > self._room:
            self._make_room(answers)

    def draw(self) -> None:
        """Draw noise where it has been used up."""
        for number in self._stopped(self.lib.KERNEL_NOISE):
            self.rings[number].draw()

    def _with_reports(self, length: int) -> bytes:
        """What has been said, each referee's report behind the words of its ring."""
        words, pieces, at = self._unpack(self._words, length) if length else b"", [], 0
        for number in self._stopped(self.lib.KERNEL_DUE):
            end = self.loop.end[number]
            pieces.append(words[at:end])
            report = self.rings[number].report()
            if self.loop.plugged[number]:
                pieces.append(report)
            at = end
        return b"".join([*pieces, words[at:]])
