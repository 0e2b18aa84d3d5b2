"""What it is told and what it tells: every message that a robot must understand has its `on_` method."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from own_robot.hardware import Plan
from own_robot.motion import Motion, addressed
from own_robot.tables import (
    ACCEPTED,
    ANY,
    ARMED_STATES,
    BAD_VALUE,
    BUSY,
    CONTEST,
    COUNTDOWN,
    DENIED,
    DRIVING,
    EMERGENCY,
    FULL,
    HISTORY,
    MAJOR,
    MAX_ACTIONS,
    NONE,
    NOT_ARMED,
    NOT_FOUND,
    OLD_SEQUENCE,
    PARAMETERS,
    PERFORMING,
    RAREST_HEARTBEAT,
    READ_ONLY,
    REJECTED,
    STOPPED,
    TICK,
    UNSUPPORTED,
    WATCHDOG,
    WRONG_SESSION,
)  # fmt: skip

if TYPE_CHECKING:
    from collections.abc import Callable

    from own_robot.wire import Message


class Robot(Motion):
    """The robot: bytes in, one control period, bytes out."""

    def tick(self, now: float, inbound: bytes) -> bytes:
        """One control period: sense, go on with what is being done, obey, report."""
        self.out, self.now = b"", now - self.born
        self.ticks += 1
        self.sense()
        if self.behaviour is not None:
            next(self.behaviour, None)
        for message in self.wire.receive(inbound, self.now):
            self.take(message)
        if self.state in {DRIVING, PERFORMING} and self.now - self.keeper_heard >= self.parameters["WATCHDOG"] / 1e3 - 1e-9:
            self.fire("release", WATCHDOG)
        self.hardware.set_wheels(*self.effort)
        self.report()
        if self.now >= self.reboot_at:
            self.hardware.set_wheels(0, 0)
            out, self.out = self.out, b""
            self.boot(now)
            return out
        return self.out

    # --- what it is told ---------------------------------------------------------------------------------------------

    def take(self, message: Message) -> None:
        """Obey a message, if it is for this robot."""
        if message.sender == (self.system, 1):
            return
        if not self.kept_by_session and message.sender == self.keeper:  # a ground station is kept in mind by any frame
            self.keeper_heard = self.now
        name = message.name
        whom = getattr(message, "target_system", getattr(message, "target", self.system))
        to_all = name in {"ping", "timesync", "command_long", "robot_alive"} or (
            name == "junior_contest" and message.command == 0
        )
        if whom not in {0, self.system} or getattr(message, "target_component", 0) not in {0, 1} or (whom == 0 and not to_all):
            return
        getattr(self, f"on_{name}")(message)

    def on_heartbeat(self, message: Message) -> None:
        """Being heard is all it is for."""

    def on_robot_alive(self, m: Message) -> None:
        """The host is there: that keeps what it has armed, and whose session it holds."""
        if m.host == self.host:
            self.hear_session()

    def hear_session(self) -> None:
        """The host of the session has been heard; whoever else armed the robot has not."""
        if self.kept_by_session:
            self.keeper_heard = self.now

    def on_mission_request_list(self, m: Message) -> None:
        """Ground stations ask, and wait: there are none."""
        self.send("mission_count", count=0, mission_type=m.mission_type, **addressed(m.sender))

    def on_ping(self, m: Message) -> None:
        """Am I there? A question has no target."""
        if m.target_system == 0:
            self.send("ping", time_usec=m.time_usec, seq=m.seq, **addressed(m.sender))

    def on_timesync(self, m: Message) -> None:
        """What time is it?"""
        if m.tc1 == 0:
            now = round(self.now * 1e9)
            self.send("timesync", tc1=now, ts1=m.ts1, **addressed(m.sender))

    def on_param_request_list(self, _: Message) -> None:
        """All parameters, one a tick."""
        self.list_next = 0

    def on_param_request_read(self, m: Message) -> None:
        """One parameter, by index or name."""
        names = list(PARAMETERS)
        name = names[m.param_index] if 0 <= m.param_index < len(names) else m.param_id if m.param_index < 0 else ""
        self.send_parameter(name, m.param_id)

    def send_parameter(self, name: str, asked: str = "") -> None:
        """Send a value, or that there is no such parameter."""
        known = name in PARAMETERS
        index = list(PARAMETERS).index(name) if known else 65535
        value = self.parameters[name] if known else math.nan
        fields = {"param_value": value, "param_type": 9, "param_count": len(PARAMETERS), "param_index": index}
        self.send("param_value", param_id=(name if known else asked).encode("latin1"), **fields)

    def on_param_set(self, m: Message) -> None:
        """What is not allowed changes nothing; the answer is the value in force."""
        if m.param_id not in PARAMETERS:
            return
        _, least, greatest, whole = PARAMETERS[m.param_id]
        value = m.param_value
        if least <= value <= greatest and not (whole and value % 1) and m.param_id not in READ_ONLY:
            self.parameters[m.param_id] = self.store.parameters[m.param_id] = value
            self.store.save()
        self.send_parameter(m.param_id)

    def on_manual_control(self, m: Message) -> None:
        """The stick of the ground station that armed the robot; 32767 means not given."""
        x, r = (0 if axis == 32767 else axis for axis in (m.x, m.r))
        theirs = m.sender == self.keeper and not self.kept_by_session
        if theirs and max(abs(x), abs(r)) <= 1000 and not self.fire("stick"):
            self.drive(max(-1, min(1, (x + r) / 1e3)), max(-1, min(1, (x - r) / 1e3)), 0.25)

    def on_command_long(self, m: Message) -> None:
        """The standard commands; to all robots only stopping."""
        stopping = m.command == 185 or (m.command == 400 and m.param1 == 0)
        if m.target_system == 0 and not stopping:
            return
        todo: dict[int, Callable[[Message], int]] = {
            400: self._arm_disarm, 185: self._stop, 246: self._reboot, 511: self._interval, 512: self._request
        }  # fmt: skip
        result = todo[m.command](m) if m.command in todo else UNSUPPORTED
        self.send("command_ack", command=m.command, result=result, progress=0, result_param2=0, **addressed(m.sender))

    def _arm_disarm(self, m: Message) -> int:
        """A host says by param3 whose session it is; a ground station leaves that empty, 0 or NaN."""
        by_host = m.param3 > 0
        if m.param1 not in {0, 1}:
            return DENIED
        if m.param1 == 0:
            self.fire("disarm", NOT_ARMED)
            return ACCEPTED
        if by_host and not (self.session_open and m.param3 == self.host):
            return DENIED
        if self.fire("arm"):
            return REJECTED
        self._keep(m.sender, by_session=by_host)
        return ACCEPTED

    def _keep(self, sender: tuple[int, int], *, by_session: bool) -> None:
        """From now on this one must be heard; what another has set in motion stops."""
        if (self.keeper, self.kept_by_session) != (sender, by_session):
            self.fire("release")
        if not by_session:
            self.session_open = False
            self.result, self.result_due = None, math.inf
        self.keeper, self.kept_by_session, self.keeper_heard = sender, by_session, self.now

    def _stop(self, m: Message) -> int:
        if m.param1 != 1:
            return DENIED
        self.fire("stop", EMERGENCY)
        return ACCEPTED

    def _reboot(self, m: Message) -> int:
        if m.param1 != 1:
            return DENIED
        self.fire("disarm", NOT_ARMED)
        self.reboot_at = self.now + 0.02
        return ACCEPTED

    def _interval(self, m: Message) -> int:
        if m.param1 not in self.intervals:
            return UNSUPPORTED
        if not -1 <= m.param2 <= 60e6 or (m.param1 == 0 and not 0 <= m.param2 <= RAREST_HEARTBEAT * 1e6):
            return DENIED
        default = {47100: 0.02, 148: 0.0}.get(int(m.param1), 1.0)
        seconds = default if m.param2 == 0 else 0.0 if m.param2 < 0 else max(TICK, m.param2 / 1e6)
        self.intervals[int(m.param1)], self.due[int(m.param1)] = seconds, self.now + seconds
        return ACCEPTED

    def _request(self, m: Message) -> int:
        if m.param1 not in self.intervals:
            return UNSUPPORTED
        self.asked.add(int(m.param1))
        return ACCEPTED

    # --- numbered messages: done once, answered as often as they come --------------------------------------------------

    def on_robot_session(self, m: Message) -> None:
        """A host begins: stop, disarm, and listen to this session alone."""
        if m.major != MAJOR or m.host == 0:
            self.acknowledge(m, BAD_VALUE)
            return
        if m.session != self.session or not self.session_open:
            self.fire("session")
            self.keeper, self.host, self.session_open = None, m.host, True  # in a contest, too: it has not armed
            self.kept_by_session = False
            self.result, self.result_due = None, math.inf
            if self.session is not None:
                self.former[self.session] = self.sequence
            while len(self.former) > 4:
                self.former.popitem(last=False)
            self.session, self.sequence = m.session, self.former.pop(m.session, m.sequence)
            self.answers.clear()
        self.acknowledge(m, NONE)

    def acknowledge(self, m: Message, reason: int) -> None:
        """Answer a numbered message."""
        numbers = {"message": m.id, "session": m.session, "sequence": m.sequence}
        self.send("robot_ack", **numbers, **addressed(m.sender), result=int(reason != NONE), reason=reason)

    def once(self, m: Message, do: Callable[[Message], int], again: Callable[[Message], None], *, tells: bool = False) -> None:
        """Do it if it is new, and say what came of it as often as it comes; where `again` tells that, it is the answer."""
        if m.session != self.session or not self.session_open:
            self.acknowledge(m, WRONG_SESSION)
            return
        self.hear_session()
        new = m.sequence not in self.answers
        if new and not 0 < (m.sequence - self.sequence) % 65536 < 32768:
            self.acknowledge(m, OLD_SEQUENCE)
            return
        if new:
            self.sequence = m.sequence
            self.answers[m.sequence] = (m.id, do(m))
            if len(self.answers) > HISTORY:
                self.answers.popitem(last=False)
        kind, reason = self.answers[m.sequence]
        if kind != m.id:
            self.acknowledge(m, OLD_SEQUENCE)
            return
        if reason or not tells:
            self.acknowledge(m, reason)
        if not reason and (tells or not new):
            again(m)

    def on_junior_wheels(self, m: Message) -> None:
        """Turn the wheels for a while."""

        def do(m: Message) -> int:
            if max(map(abs, m.speed)) > 1000 or m.duration > 5000:
                return BAD_VALUE
            reason = self.fire("drive")
            if not reason:
                self.drive(m.speed[0] / 1e3, m.speed[1] / 1e3, m.duration / 1e3)
            return reason

        self.once(m, do, lambda _: None)

    def on_junior_maneuver(self, m: Message) -> None:
        """Perform a maneuver; asked again when it is over, tell the result again."""

        def do(m: Message) -> int:
            plan = Plan.read(m)
            reason = BAD_VALUE if plan is None else self.fire("perform")
            if plan is not None and not reason:
                self.result, self.result_due = self.begin(plan, m.sequence, m.sender), math.inf
                self.behaviour = self._maneuver(plan)
                next(self.behaviour)
            return reason

        def again(m: Message) -> None:
            if self.result is not None and "outcome" in self.result and self.result["sequence"] == m.sequence:
                self.result_due = self.now

        self.once(m, do, again)

    def on_robot_result_ack(self, m: Message) -> None:
        """The result has arrived: no need to repeat it."""
        if self.result is not None and (m.session, m.sequence) == (self.result["session"], self.result["sequence"]):
            self.result_due = math.inf

    def on_junior_contest(self, m: Message) -> None:
        """Play from memory, or stop playing."""

        def do(m: Message) -> int:
            if m.command == 0:
                return self.fire("end")
            if m.command != 1 or m.countdown > 60000:
                return BAD_VALUE
            if not self.store.memory:
                return NOT_FOUND
            reason = self.fire("contest")
            if not reason:
                self.behaviour = self._contest(m.countdown / 1e3)
            return reason

        self.once(m, do, lambda _: None)

    def on_junior_memory_write(self, m: Message) -> None:
        """Store a maneuver, erase one (count 0), or erase all."""

        def do(m: Message) -> int:
            memory, key = self.store.memory, (m.previous, m.current)
            if self.state in {COUNTDOWN, CONTEST}:
                return BUSY
            if m.count == 0 and key == (ANY, ANY):
                memory.clear()
            elif m.current > 15 or (m.previous > 15 and m.previous != ANY):
                return BAD_VALUE
            elif m.count == 0:
                memory.pop(key, None)
            else:
                plan = Plan.read(m)
                if plan is None:
                    return BAD_VALUE
                if key not in memory and len(memory) >= PARAMETERS["MEM_SLOTS"][0]:
                    return FULL
                memory[key] = plan
            self.store.save()
            return NONE

        self.once(m, do, lambda _: None)

    def on_junior_memory_read(self, m: Message) -> None:
        """A slot is its own answer."""
        keys = sorted(self.store.memory)
        asked = m.previous, m.current
        index = m.index if m.index != 255 else keys.index(asked) if asked in keys else 255
        found = index < len(keys)
        self.once(m, lambda _: NONE if found else NOT_FOUND, lambda m: self.send_entry(m, keys, index), tells=True)

    def send_entry(self, m: Message, keys: list[tuple[int, int]], index: int) -> None:
        """Send a slot, and the checksum of all; nothing where it has been erased since it was first asked for."""
        if index >= len(keys):
            return
        padded = {key: plan.actions + [0] * (MAX_ACTIONS - len(plan.actions)) for key, plan in self.store.memory.items()}
        crc = self.dialect.x25crc()
        for key in keys:
            plan = self.store.memory[key]
            crc.accumulate(bytes([*key, plan.options, *padded[key], *plan.period.to_bytes(2, "little"), len(plan.actions)]))
        key, plan = keys[index], self.store.memory[keys[index]]
        numbers = {"session": m.session, "sequence": m.sequence, "checksum": crc.crc, "used": len(keys), "index": index}
        about = {"previous": key[0], "current": key[1], "period": plan.period, "options": plan.options}
        self.send(
            "junior_memory_entry", **addressed(m.sender), **numbers, **about, count=len(plan.actions), actions=padded[key]
        )

    # --- what it tells -----------------------------------------------------------------------------------------------

    def report(self) -> None:
        """Results, streams, and parameters that were asked for."""
        if self.now >= self.result_due - 1e-9 and self.result is not None:
            self.send("junior_maneuver_result", **self.result)
            self.result_due = self.now + 0.1
        for kind, interval in self.intervals.items():
            due = interval > 0 and self.now >= self.due[kind] - 1e-9
            if due or kind in self.asked:
                self.stream(kind)
            if due:
                self.due[kind] = max(self.due[kind] + interval, self.now)
        self.asked.clear()
        if self.list_next < len(PARAMETERS):
            self.send_parameter(list(PARAMETERS)[self.list_next])
            self.list_next += 1

    def stream(self, kind: int) -> None:
        """Send one of the regular messages."""
        micros, armed, counters = round(self.now * 1e6), self.state in ARMED_STATES, self.wire.counters
        match kind:
            case 0:
                status = 6 if self.state == STOPPED else 4 if armed else 3
                mode = 1 | 64 | (128 if armed else 0)
                self.send(
                    "heartbeat",
                    type=10,
                    autopilot=0,
                    base_mode=mode,
                    custom_mode=self.state,
                    system_status=status,
                    mavlink_version=3,
                )
            case 1:
                health = dict.fromkeys((f"onboard_control_sensors_{word}" for word in ("present", "enabled", "health")), 0)
                errors = {f"errors_count{number}": 0 for number in range(1, 5)}
                power = {"voltage_battery": self.hardware.battery(), "current_battery": -1, "battery_remaining": -1}
                self.send("sys_status", **health, **errors, **power, load=0, drop_rate_comm=0, errors_comm=0)
            case 47100:
                both = {name: [read(0), read(1)] for name, read in (("eye", self.hardware.eye), ("floor", self.hardware.floor))}
                travel = [int(self.travel[0]), int(self.travel[1])]
                battery = self.hardware.battery()
                self.send("junior_sensors", time=micros, travel=travel, battery=battery, flags=self.flags, **both)
            case 47109:
                numbers = {"boot_count": self.store.boots, "session": self.session or 0, "sequence": self.sequence}
                self.send("robot_status", time=micros, maneuvers=self.maneuvers, state=self.state, **counters, **numbers)
            case _:
                none = {f"{word}_custom_version": [0] * 8 for word in ("flight", "middleware", "os")}
                version = {"flight_sw_version": 1 << 24, "middleware_sw_version": MAJOR << 24, "os_sw_version": 0}
                capabilities = 2 | 2048 | 8192 | 131072
                ids = {"board_version": 0, "vendor_id": 0, "product_id": 0, "uid": self.hardware.uid}
                self.send("autopilot_version", capabilities=capabilities, **version, **none, **ids)


Robot.known = tuple(name.removeprefix("on_").upper() for name in vars(Robot) if name.startswith("on_"))
