"""Juniors at a glance, for `hil monitor`: what there is to see of them, and what keys do to the chosen one."""

from __future__ import annotations

from collections import defaultdict
from functools import partial
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import BoutOutcome, Phase
from firmware_protocol.roles.junior import drive
from firmware_protocol.roles.referee import reset_bout
from hil.cockpit.snapshot import Row, Snapshot
from hil.connecting.handle import answered
from hil.jobs.watched import junior_words
from hil.jobs.watched.dead_man import HOLD, DeadMan
from hil.jobs.watched.orders import OrderQueue, taken
from hil.jobs.watched.quality import Quality
from hil.sumo.referee import NOBODY

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from firmware_protocol.errors import HilError
    from hil.cockpit.snapshot import PlanView, Senses
    from hil.connecting.handles import RobotHandles
    from hil.sumo.junior import Junior

SPEED, TURN = 0.6, 0.35
DRIVES: Final = {"^": (SPEED, SPEED), "v": (-SPEED, -SPEED), "<": (-TURN, TURN), ">": (TURN, -TURN)}
NEXT, BEFORE, STOP_ALL = "n", "p", "E"
OLD_HOLD: Final = 0.3
"""For how long a key drove in logs of before, in s, measured from when the robot was told."""
HELP: Final = (("a", "arm"), ("arrows", "drive"), ("space", "stop"), ("e", "emergency stop"), ("d", "disarm"))
HELP_MANY: Final = (("n p", "choose"), *HELP, ("E", "emergency stop of all"))
HELP_SHARED: Final = (("e", "emergency stop"),)
"""Where another program drives, and shares its link."""
HELP_SHARED_MANY: Final = (("n p", "choose"), *HELP_SHARED, ("E", "emergency stop of all"))
HELP_BOUT: Final = (("b", "new bout"),)
_TRAIL: Final = 200
"""Places that are remembered of where a robot has been."""


class JuniorsWatch:
    """Which of several Juniors is chosen, and what there is to see of all.

    Keys are obeyed bit by bit, in `step`: nothing here waits for an answer.

    Args:
        robots: The robots.
        tell: Says what is worth to be known; None: nobody wants to know.
        refused: Is told why a robot did not obey.
        seed: Start poses of bouts that are begun follow from it.
        hold: Driving ends so long after the last key, in s; None: as logs of before have it.
    """

    def __init__(
        self,
        robots: RobotHandles[Junior],
        *,
        tell: Callable[[str], object] | None = None,
        refused: Callable[[HilError], object] | None = None,
        seed: int = 0,
        hold: float | None = HOLD,
    ) -> None:
        self._robots = robots
        self._tell = tell
        self._refused = refused
        self._seed = seed
        self._hold = hold
        self._bouts = 0
        self._chosen: Junior | None = None
        self._orders: defaultdict[Junior, OrderQueue] = defaultdict(OrderQueue)
        self._driving: dict[Junior, DeadMan] = {}
        self._quality: defaultdict[Junior, Quality] = defaultdict(Quality)
        self._trail: list[tuple[float, float]] = []
        self._trail_of = 0
        self._bout_told: tuple[int, int] = (0, 0)

    # --- who is there ------------------------------------------------------------------------------------------------

    @property
    def members(self) -> list[Junior]:
        """Every robot that is or was there, in order."""
        return [junior for _, junior in sorted(self._robots.members.items())]

    @property
    def chosen(self) -> Junior:
        """The robot that keys act on: the same one until another is chosen, whoever joins."""
        if self._chosen is None:
            self._chosen = self.members[0]
        return self._chosen

    def aim(self, keys: str) -> list[str]:
        """For which robot each of several keys is, if they are pressed one after the other.

        Args:
            keys: The keys.

        Returns:
            System ids; empty for a key that is for all, or for none.
        """
        members = self.members
        chosen = members.index(self.chosen)
        aimed = []
        for key in keys:
            if key in {NEXT, BEFORE}:
                chosen = (chosen + (1 if key == NEXT else -1)) % len(members)
            aimed.append("" if key == STOP_ALL else str(members[chosen].peer.system))
        return aimed

    # --- what keys do ------------------------------------------------------------------------------------------------

    @property
    def busy(self) -> bool:
        """Something that was asked for has not been answered yet."""
        return any(orders.open for orders in self._orders.values()) or any(each.open for each in self._driving.values())

    def press(self, key: str) -> None:
        """Begin what a key asks. The first that moves a robot takes it: by that it is stopped and disarmed, and no other is.

        What stops is begun at once, and what was asked for before is not done any more.

        Args:
            key: The key.
        """
        junior = self.chosen
        match key:
            case "n" | "p":
                self._choose(1 if key == NEXT else -1)
            case "E":
                self._robots.call_emergency_stop()
                for each in self.members:
                    self._stop(each, partial(self._stopping, each))
            case "e":
                self._stop(junior, partial(self._stopping, junior))
            case "d":
                self._stop(junior, partial(self._disarming, junior))
            case " ":
                self._stop_all()
            case "a":
                self._orders[junior].give(partial(self._arming, junior))
            case "b" if junior.referee is not None:
                self._bouts += 1
                self._orders[junior].give(partial(self._beginning, junior, (self._seed + self._bouts - 1) % 2**32))
            case _ if key in DRIVES:
                if not junior.peer.taken and not self._orders[junior].open:
                    self._orders[junior].give(lambda: taken(junior))
                self._dead_man(junior).press(DRIVES[key])
        self.step()

    def step(self) -> None:
        """Go on with what keys have asked for; called after every step of the links."""
        for orders in self._orders.values():
            for error in orders.step():
                self._say_refused(error)
        for junior, driving in self._driving.items():
            for error in driving.step(free=not self._orders[junior].open):
                self._say_refused(error)
        self._tell_of_bout()

    def _choose(self, further: int) -> None:
        members = self.members
        self._chosen = members[(members.index(self.chosen) + further) % len(members)]
        self._trail.clear()

    def _stop_all(self) -> None:
        """Stop the wheels of all that are ours, and of the chosen one in any case."""
        for each in self.members:
            if each.peer.taken or each is self.chosen:
                self._stop(each, partial(self._standing, each))

    def _dead_man(self, junior: Junior) -> DeadMan:
        found = self._driving.get(junior)
        if found is None:
            hold = OLD_HOLD if self._hold is None else self._hold
            found = self._driving[junior] = DeadMan(junior, hold, measured=self._hold is not None)
        return found

    def _stop(self, junior: Junior, order: Callable[[], Iterator[None]]) -> None:
        if junior in self._driving:
            self._driving[junior].release()
        self._orders[junior].instead(order)

    def _stopping(self, junior: Junior) -> Iterator[None]:
        yield from answered(junior.ask_emergency_stop())
        self._say(f"robot {junior.peer.system} has stopped, and says so: emergency stop")

    def _disarming(self, junior: Junior) -> Iterator[None]:
        yield from answered(junior.ask_disarm())
        self._say(f"robot {junior.peer.system} is disarmed")

    def _standing(self, junior: Junior) -> Iterator[None]:
        yield from taken(junior)
        yield from answered(drive(junior.peer, 0.0, 0.0, 0.0))

    def _arming(self, junior: Junior) -> Iterator[None]:
        yield from taken(junior)
        yield from junior.arming()
        self._say(f"robot {junior.peer.system} is armed")

    def _beginning(self, junior: Junior, seed: int) -> Iterator[None]:
        yield from taken(junior)
        yield from answered(reset_bout(junior.peer, seed))

    def _say_refused(self, error: HilError) -> None:
        if self._refused is not None:
            self._refused(error)
        self._say(str(error))

    def _say(self, text: str) -> None:
        if self._tell is not None:
            self._tell(text)

    def _tell_of_bout(self) -> None:
        """Say how a bout has ended."""
        referee = self.chosen.referee
        if referee is None or self._tell is None:
            return
        word = referee.latest
        if (word.bout, word.phase) != self._bout_told:
            self._bout_told = (word.bout, word.phase)
            if word.phase == Phase.OVER:
                ended = junior_words.OUTCOMES.get(BoutOutcome(word.outcome), "over")
                self._tell(f"bout {word.bout} is {ended} after {word.elapsed:.1f} s")

    # --- what there is to see ----------------------------------------------------------------------------------------

    def lines(self) -> list[str]:
        """All robots in plain lines; none of one that has not said anything yet."""
        members = self.members
        if len(members) == 1:
            sensors = members[0].latest
            return [] if sensors is None else [junior_words.line(members[0], sensors)]
        heads = ("robot", "", "", "senses", "frames", "lost", "rejected", "answers in")
        return [
            "  ".join(f"{head} {cell}".strip() for head, cell in zip(heads, junior_words.cells(junior), strict=True))
            for junior in members
        ]

    def document(self) -> dict[str, object] | list[dict[str, object]]:
        """What `--json` prints: one robot, or a list of all that have said something.

        Raises:
            HilError: The only robot can't be asked what it senses.
        """
        members = self.members
        if len(members) == 1:
            return junior_words.plain(members[0], members[0].latest or members[0].read_sensors())
        return [junior_words.plain(each, each.latest) for each in members if each.latest is not None]

    def picture(self) -> Snapshot:
        """What is to be seen now."""
        members, junior, now = self.members, self.chosen, self._robots.now()
        for each in members:
            self._quality[each].look(now, each.peer.counters)
        state, tone = junior_words.state(junior)
        many = len(members) > 1
        keys = (*(HELP_MANY if many else HELP), *(HELP_BOUT if junior.referee is not None else ()))
        if junior.bridge.acquaintances.shared:
            keys = HELP_SHARED_MANY if many else HELP_SHARED
        return Snapshot(
            title=f"{len(members)} Juniors on {next(iter(self._robots.networks.bridges))}" if many else junior.description,
            now=now,
            state=f"robot {junior.peer.system}: {state}" if many else state,
            tone=tone,
            facts=(*junior_words.facts(junior), *self._quality[junior].facts(now, junior.peer.counters)),
            ground=self._ground(junior),
            heads=("robot", "state", "battery", "senses", "frames", "lost", "rejected", "answers") if many else (),
            rows=tuple(Row(junior_words.cells(each), junior_words.state(each)[1]) for each in members) if many else (),
            chosen=members.index(junior),
            keys=keys,
        )

    def _ground(self, junior: Junior) -> PlanView | Senses | None:
        """Where it is, by the referee's word; else what it senses."""
        if junior.referee is not None and junior.referee.latest is not NOBODY:
            word = junior.referee.latest
            if word.bout != self._trail_of:
                self._trail_of = word.bout
                self._trail.clear()
            self._trail = [*self._trail[-_TRAIL:], (word.junior[0], word.junior[1])]
            return junior_words.ring(word, tuple(self._trail))
        return None if junior.latest is None else junior_words.senses(junior.latest)
