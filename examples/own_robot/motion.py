"""What it senses and what it does: every motion is a generator, advanced once a control period and closed by any stop."""

from __future__ import annotations

import math
from collections import OrderedDict
from typing import TYPE_CHECKING, Any

from own_robot.hardware import Plan
from own_robot.tables import (
    ACTIONS,
    ANY,
    BUSY,
    BY_COMMAND,
    CHANGED,
    COMPLETED,
    CONTEST,
    DISARMED,
    DRIVING,
    MAX_ACTIONS,
    NEXT,
    NONE,
    OPTION_CHANGE,
    OPTION_HOLD,
    OPTION_REFLEX,
    PARAMETERS,
    PERFORMING,
    REFLEX,
    REPLACED,
    SPEEDS,
    STOPPED_EARLY,
    TICK,
    TURN_LEFT,
    TURN_RIGHT,
)  # fmt: skip
from own_robot.wire import Wire

if TYPE_CHECKING:
    from collections.abc import Generator

    from own_robot.hardware import Hardware, Store


def addressed(asker: tuple[int, int]) -> dict[str, int]:
    """The fields of an answer that say whom it is for: the sender of the question, system and component."""
    return {"target_system": asker[0], "target_component": asker[1]}


class Motion:
    """Senses and moves. What it is told, and what it tells, is the business of `Robot`."""

    known: tuple[str, ...] = ()
    """Messages that are understood."""

    def __init__(self, dialect: Any, hardware: Hardware, store: Store) -> None:  # noqa: ANN401
        self.dialect, self.hardware, self.store = dialect, hardware, store
        store.load()
        self.boot(0.0)

    def boot(self, now: float) -> None:
        """Come up disarmed."""
        self.store.boots = self.store.boots % 65535 + 1
        self.store.save()
        self.parameters = {name: row[0] for name, row in PARAMETERS.items()} | self.store.parameters
        self.system = int(self.parameters["SYS_ID"])
        self.wire = Wire(self.dialect, self.system, self.known)
        self.born, self.now, self.ticks = now, 0.0, 0
        self.state = DISARMED
        self.behaviour: Generator[None, None, None] | None = None
        self.effort, self.travel = [0, 0], [0.0, 0.0]
        self.flags = self.edges = 0
        self.arms: list[list[float]] = [[0, 0.0, 0.0], [0, 0.0, 0.0]]  # switch, since when; pressed since when
        self.keeper: tuple[int, int] | None = None  # system and component of who armed it
        self.kept_by_session, self.keeper_heard = False, 0.0
        self.reboot_at = math.inf
        self.session: int | None = None
        self.session_open, self.host, self.sequence = False, 0, 0
        self.former: OrderedDict[int, int] = OrderedDict()
        self.answers: OrderedDict[int, tuple[int, int]] = OrderedDict()
        self.result: dict[str, Any] | None = None
        self.result_due, self.maneuvers = math.inf, 0
        self.intervals = {0: 1.0, 1: 1.0, 47100: 0.02, 47109: 1.0, 148: 0.0}
        self.due = dict.fromkeys(self.intervals, 0.0)
        self.asked: set[int] = set()
        self.list_next = len(PARAMETERS)
        self.out = b""

    def send(self, name: str, **fields: Any) -> None:  # noqa: ANN401
        """Put a message on the wire."""
        self.out += self.wire.encode(name, **fields)

    # --- what it senses ----------------------------------------------------------------------------------------------

    def sense(self) -> None:
        """From counts and switches to flags."""
        value, before, self.edges = self.parameters, self.flags, 0
        flags = (256 if self.hardware.encoders else 0) | (512 if self.hardware.ground_odometer else 0)
        for side, letter in enumerate("LR"):
            hysteresis = value["EYE_HYST"] if before & 1 << side else 0
            flags |= (self.hardware.eye(side) >= value[f"EYE_{letter}_ON"] - hysteresis) << side
            off = self.hardware.floor(side) >= value[f"FLOOR_{letter}_OFF"]
            flags |= (off != bool(value["FLOOR_INVERT"])) << 6 + side
            flags |= self._arm(side, bool(before & 4 << side))
            self.travel[side] += self.effort[side] * value["WHEEL_SPEED"] / 1e3 * TICK
        self.flags = flags

    def _arm(self, side: int, pressed: bool) -> int:  # noqa: FBT001
        """A switch counts once it has been steady; pressed long enough, it holds."""
        arm, closed = self.arms[side], self.hardware.arm(side)
        if closed != arm[0]:
            arm[0], arm[1] = closed, self.now
        if closed != pressed and self.now - arm[1] >= self.parameters["ARM_DEBOUNCE"] / 1e3:
            pressed, arm[2] = closed, self.now
            self.edges |= closed << side
        held = pressed and self.now - arm[2] >= self.parameters["ARM_HOLD"] / 1e3
        return (pressed << 2 | held << 4) << side

    # --- what it does ------------------------------------------------------------------------------------------------

    def fire(self, event: str, reason: int = BY_COMMAND) -> int:
        """Go to the next state, and end what was going on; returns why not, or 0."""
        to = NEXT[event][self.state]
        if to < 0:
            return -to
        if event == "arm" and self.reboot_at < math.inf:
            return BUSY
        if self.behaviour is not None and (to != self.state or event in {"perform", "drive", "stick", "contest"}):
            if self.result is not None and "outcome" not in self.result:
                self.finish(REPLACED if event in {"perform", "drive"} else STOPPED_EARLY, reason)
            self.behaviour = None
        self.state = to
        if to not in {DRIVING, PERFORMING, CONTEST}:
            self.effort = [0, 0]
        if to == DISARMED:
            self.keeper = None
        return NONE

    def wheels(self, left: float, right: float) -> None:
        """Set both wheels, shares of full; trimmed."""
        self.effort = [int(left * self.parameters["TRIM_LEFT"] * 1e3), int(right * self.parameters["TRIM_RIGHT"] * 1e3)]

    def act(self, code: int) -> None:
        """Turn the wheels as an action says."""
        speed, left, right = ACTIONS[code]
        self.wheels(left * self.parameters[SPEEDS[speed]], right * self.parameters[SPEEDS[speed]])

    def drive(self, left: float, right: float, duration: float) -> None:
        """Turn the wheels for a while."""
        self.wheels(left, right)
        self.behaviour = self._drive(self.now + duration)
        if duration <= 0:
            self.fire("done")

    def _drive(self, until: float, *, guarded: bool = False) -> Generator[None, None, None]:
        while self.now < until - 1e-9 and not (guarded and self.flags >> 6 & 3):
            yield
        self.fire("done")

    def _perform(self, plan: Plan, result: dict[str, Any]) -> Generator[None, None, int]:
        """The actions, one after the other; returns how it ended."""
        counted = (3 if plan.options & 4 else 0) | (12 if plan.options & 8 else 0)
        begun, changing = self.flags & 15, 0
        for number, code in enumerate(plan.actions):
            self.act(code)
            press = [0, 0]
            for left in reversed(range(max(1, math.ceil(plan.period / 5)))):
                yield
                self._sample(result, number, press)
                if plan.options & OPTION_REFLEX and self.flags >> 6 & 3:
                    yield from self._save_itself()
                    return REFLEX
                changing = changing + 1 if (self.flags ^ begun) & counted else 0
                if plan.options & OPTION_CHANGE and changing > 4 and left:  # 20 ms: a flicker is no change
                    return CHANGED
            result["done"] = number + 1
        return COMPLETED

    def _sample(self, result: dict[str, Any], number: int, press: list[int]) -> None:
        result["samples"][number] += 1
        for side, name in enumerate(("left", "right")):
            result[f"eye_{name}"][number] += self.flags >> side & 1
            result[f"edges_{name}"][number] += self.edges >> side & 1
            press[side] = press[side] + 5 if self.flags & 4 << side else 0
            result[f"press_{name}"][number] = max(result[f"press_{name}"][number], press[side])

    def _save_itself(self) -> Generator[None, None, None]:
        """The floor reflex: back off, and turn away from the side that saw the border."""
        turn = TURN_LEFT if self.flags >> 6 & 3 == 2 else TURN_RIGHT
        self.wheels(-self.parameters["REFLEX_SPEED"], -self.parameters["REFLEX_SPEED"])
        yield from self._spend(self.parameters["REFLEX_BACK"])
        self.act(turn)
        yield from self._spend(self.parameters["REFLEX_TURN"])

    def _spend(self, duration_ms: float) -> Generator[None, None, None]:
        for _ in range(math.ceil(duration_ms / 5)):
            yield

    def _maneuver(self, plan: Plan) -> Generator[None, None, None]:
        """A maneuver that a host asked for."""
        assert self.result is not None
        outcome = yield from self._perform(plan, self.result)
        self.finish(outcome, NONE)
        self.behaviour = None
        hold = self.parameters["MAN_HOLD"] / 1e3 if plan.options & OPTION_HOLD and outcome != REFLEX else 0.0
        self.fire("drive" if hold else "done")
        if hold:  # the wheels go on as they are, but not over the border
            self.behaviour = self._drive(self.now + hold, guarded=bool(plan.options & OPTION_REFLEX))

    def begin(self, plan: Plan, sequence: int | None, asker: tuple[int, int] = (0, 0)) -> dict[str, Any]:
        """A new result to count into, for who asked for it."""
        self.maneuvers += 1
        names = ("samples", "eye_left", "eye_right", "press_left", "press_right", "edges_left", "edges_right")
        result: dict[str, Any] = {name: [0] * MAX_ACTIONS for name in names}
        result |= {"travel": [-32768] * MAX_ACTIONS, "done": 0, "stimulus_before": self.flags & 15}
        result |= {"session": self.session, "sequence": sequence, **addressed(asker)}
        self.act(plan.actions[0])
        return result

    def finish(self, outcome: int, reason: int) -> None:
        """The result is complete: send it until somebody acknowledges it."""
        assert self.result is not None
        self.result |= {"outcome": outcome, "reason": reason, "stimulus_after": self.flags & 15}
        self.result_due = self.now
        if outcome == REPLACED:
            self.send("junior_maneuver_result", **self.result)

    def _contest(self, countdown: float) -> Generator[None, None, None]:
        """Play from memory, with no host at all."""
        start, previous = self.now + countdown, 0
        while self.now < start - 1e-9:
            yield
        self.state = CONTEST
        while True:
            limit = self.parameters["CONTEST_MAX"]
            if limit and self.now - start >= limit:
                self.fire("end")
                return
            current = self.flags & (15 if self.parameters["STIM_ARMS"] else 3)
            keys = ((previous, current), (ANY, current), (ANY, current & 3))
            plan = next((self.store.memory[key] for key in keys if key in self.store.memory), Plan(250, 6, [TURN_LEFT]))
            previous = current
            acting = self._perform(Plan(plan.period, plan.options | OPTION_REFLEX, plan.actions), self.begin(plan, None))
            for _ in acting:
                if limit and self.now - start >= limit:
                    break
                yield
