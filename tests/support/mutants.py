"""Deliberately broken firmwares: the real sources with one thing changed, built into a library beside the real one."""

from __future__ import annotations

import os
import shlex
import subprocess
import sysconfig
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import cffi

from firmware_protocol.firmware.build_host import DECLARATIONS, FIRMWARE, PARTS, ROOT
from firmware_protocol.wire.fields import MAVLINK
from simdevice import _host
from simdevice.build_host import FLAGS, KERNEL, declarations

if TYPE_CHECKING:
    from collections.abc import Iterable

_FOLDER: Final = ROOT / FIRMWARE
_KERNEL: Final = ROOT / KERNEL
_REST: Final = _host.ffi.sizeof("host_robot") - _host.ffi.sizeof("host_io")


@dataclass(frozen=True)
class Mutant:
    """One broken firmware.

    Attributes:
        caught_by: Name of the check that must fail, alone.
        fault: What is wrong with it.
        source: File of the core or of a role that is changed.
        before: Text in it, that is there once.
        after: What stands there instead.
        wire: What the firmware speaks when it is checked.
        keyed: It signs then.
    """

    caught_by: str
    fault: str
    source: str
    before: str
    after: str
    wire: str = MAVLINK
    keyed: bool = False

    def path(self, firmware: Path) -> Path:
        """The file that is changed, in a folder with the firmware's sources."""
        return next(path for part in PARTS if (path := firmware / part / self.source).is_file())

    @property
    def of_core(self) -> bool:
        """What is changed is what any robot has."""
        return self.path(_FOLDER).parent.name == PARTS[0]

    def text(self) -> str:
        """The changed source."""
        text = self.path(_FOLDER).read_text(encoding="utf-8")
        assert text.count(self.before) == 1, f"{self.source} does not hold {self.before!r} once"
        return text.replace(self.before, self.after)


@dataclass(frozen=True)
class Build:
    """A build of the firmware, as `Board` takes it."""

    ffi: Any
    lib: Any


class Workshop:
    """Builds firmwares.

    Args:
        folder: Where to.
        kernel: With the kernel, by which micro-robots live on their table.
    """

    def __init__(self, folder: Path, *, kernel: bool = False) -> None:
        self._folder = folder
        self._kernel = sorted(_KERNEL.glob("*.c")) if kernel else []
        self._declarations = DECLARATIONS + (declarations() if kernel else "")
        self._compiler = shlex.split(os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc")
        self._includes = ["-DFIRMWARE_CAN=1", "-DFIRMWARE_SIGNING=1"] + [
            f"-I{folder}" for folder in (_FOLDER, _FOLDER / "targets/host", _FOLDER / "_build", _KERNEL)
        ]

    def build(self, mutants: Iterable[Mutant]) -> list[Build]:
        """Build the mutants, and the unchanged sources once."""
        sources = [*(path for part in PARTS for path in sorted((_FOLDER / part).glob("*.c"))), _FOLDER / "targets/host/host.c"]
        sources += self._kernel
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            objects = dict(zip(map(self._name, sources), pool.map(self._object, sources), strict=True))
            return list(pool.map(lambda pair: self._mutant(pair[0], pair[1], objects), enumerate(mutants)))

    def _name(self, source: Path) -> str:
        """No two files of the firmware have one name; the kernel is another matter."""
        return str(source) if source in self._kernel else source.name

    def _run(self, *arguments: object) -> None:
        done = subprocess.run([*self._compiler, *map(str, arguments)], check=False, capture_output=True, text=True)  # noqa: S603
        assert done.returncode == 0, done.stderr

    def _object(self, source: Path) -> Path:
        target = self._folder / f"{source.parent.name}-{source.stem}.o"
        how = ["-O2", *FLAGS] if source in self._kernel else ["-O0"]
        self._run("-std=c99", *how, "-fPIC", "-w", *self._includes, "-c", source, "-o", target)
        return target

    def _mutant(self, number: int, mutant: Mutant, objects: dict[str, Path]) -> Build:
        folder = self._folder / f"mutant{number}"
        folder.mkdir()
        source = folder / mutant.source
        source.write_text(mutant.text(), encoding="utf-8")
        changed = folder / f"{source.stem}.o"
        self._run("-std=c99", "-O0", "-fPIC", "-w", *self._includes, "-c", source, "-o", changed)
        library = folder / "firmware.so"
        self._run("-shared", *{**objects, mutant.source: changed}.values(), "-o", library)
        ffi = cffi.FFI()
        ffi.cdef(self._declarations.replace("host_io io; ...;", f"host_io io; uint8_t rest[{_REST}];"))
        return Build(ffi, ffi.dlopen(str(library)))


MUTANTS: Final = (
    Mutant(
        "bad-checksum-dropped",
        "takes frames whatever their checksum",
        "frame.c",
        "return bytes[HEADER + length] == (uint8_t)crc && bytes[HEADER + length + 1] == (uint8_t)(crc >> 8);",
        "return true;",
    ),
    Mutant(
        "partial-frame-dropped",
        "waits for the rest of a frame for ever",
        "frame.c",
        "robot->time.now - frame->heard >= SILENCE_MS",
        "false",
    ),
    Mutant(
        "impossible-length-refused",
        "believes any length, and waits for what is not coming",
        "frame.c",
        "if (row == NULL || bytes[AT_LENGTH] > flash_u8(&row->length)) {",
        "if (row == NULL) {",
    ),
    Mutant(
        "unknown-message-counted",
        "does not count what it does not know",
        "frame.c",
        "            count_sequence(robot, from, bytes[AT_SEQUENCE], false);\n            robot->counters.unknown++;",
        "            count_sequence(robot, from, bytes[AT_SEQUENCE], false);",
    ),
    Mutant(
        "other-target-ignored",
        "does what is said to other robots",
        "frame.c",
        "if (direct && message.bytes[system_at] != robot->system) {",
        "if (false) {",
    ),
    Mutant(
        "all-means-stop-only",
        "does whatever is said to all",
        "protocol.c",
        "if (!direct && !for_all(robot, id, message)) {",
        "if (false) {",
    ),
    Mutant(
        "heartbeat-tells-state",
        "never says that it is armed",
        "stream.c",
        "heartbeat.base_mode |= MAV_MODE_FLAG_SAFETY_ARMED;",
        ";",
    ),
    Mutant(
        "sensors-50-hz",
        "sends its sensors at 25 Hz",
        "junior.c",
        "{JUNIOR_STREAM_TABLE(STREAM_ROW)}",
        "{{MAVLINK_MSG_ID_JUNIOR_SENSORS, 40}}",
    ),
    Mutant(
        "parameters-refuse-nan",
        "takes NaN for a number within any limits",
        "params.c",
        "if (!(value >= flash_float(&row->minimum) && value <= flash_float(&row->maximum))) {",
        "if (value < flash_float(&row->minimum) || value > flash_float(&row->maximum)) {",
    ),
    Mutant(
        "parameters-whole",
        "takes fractions where whole numbers are asked for",
        "params.c",
        "return !(flash_u8(&row->flags) & PARAM_FLAG_WHOLE) || (float)(int16_t)value == value;",
        "return true;",
    ),
    Mutant(
        "parameters-read-only",
        "lets its own parameters be set",
        "params.c",
        "if (!(flash_u8(&row_of(robot, index)->flags) & PARAM_FLAG_READ_ONLY) && allowed(",
        "if (allowed(",
    ),
    Mutant(
        "same-sequence-performs-once",
        "performs a message as often as it comes",
        "numbered.c",
        "    if (answer != NULL) {\n        repeat(robot, id, message, answer);\n        return;\n    }\n",
        "    if (answer != NULL && id == MAVLINK_MSG_ID_JUNIOR_MANEUVER && answer->reason == 0) {\n"
        "        numbered_finish(robot, id, sequence, ROLE_OF(robot, perform)(robot, id, message));\n        return;\n    }\n"
        "    if (answer != NULL) {\n        repeat(robot, id, message, answer);\n        return;\n    }\n",
    ),
    Mutant(
        "older-sequence-refused",
        "takes messages in any order",
        "numbered.c",
        "if ((int16_t)(uint16_t)(sequence - session->last) <= 0) {",
        "if (sequence == session->last) {",
    ),
    Mutant(
        "former-session-not-repeated",
        "forgets what it has done when a session is opened",
        "numbered.c",
        "        last = session->former[i].last;",
        "        ;",
    ),
    Mutant(
        "new-session-disarms",
        "stays armed when a new host comes",
        "states.c",
        "    /* DRV */ {DRV,    DIS,   STP,  DIS,",
        "    /* DRV */ {DRV,    DIS,   STP,  DRV,",
    ),
    Mutant(
        "emergency-stop-latched",
        "lets itself be armed after an emergency stop",
        "states.c",
        "/* STP */ {NO_EST,",
        "/* STP */ {RDY,",
    ),
    Mutant(
        "watchdog-stops",
        "goes on when its host is gone",
        "states.c",
        "robot->time.now - robot->keeper.heard >= (uint32_t)params_get(robot, ROLE_OF(robot, param_watchdog))",
        "false",
    ),
    Mutant(
        "failures-need-consent",
        "fails whenever anybody asks for it",
        "failure.c",
        "params_get(robot, ROLE_OF(robot, param_fail_enable)) != 0;",
        "robot != NULL;",
    ),
    Mutant(
        "wheels-run-out",
        "drives for twice the time",
        "commands.c",
        "request->speed[RIGHT], request->duration);",
        "request->speed[RIGHT], (uint16_t)(2U * request->duration));",
    ),
    Mutant(
        "result-repeated",
        "says a result once",
        "maneuver.c",
        "        maneuver->result_due = junior->robot.time.now + REPEAT_MS;",
        "        maneuver->result_pending = false;",
    ),
    Mutant(
        "end-on-change",
        "does not care for a change of stimulus",
        "maneuver.c",
        "    return junior->robot.time.now - maneuver->changing_since >= STEADY_MS;",
        "    return false;",
    ),
    Mutant(
        "maneuver-holds",
        "goes on after a maneuver as if it had been driven, whatever MAN_HOLD says",
        "maneuver.c",
        "    driving_run(junior, (uint16_t)params_get(&junior->robot, JUNIOR_PARAM_MAN_HOLD),\n",
        "    driving_run(junior, 5000U,\n",
    ),
    Mutant(
        "memory-checksum",
        "keeps an old checksum",
        "memory.c",
        "    uint16_t slot_key = key(junior, slot);\n    uint8_t at = memory->used++;\n\n    memory->checked = false;\n",
        "    uint16_t slot_key = key(junior, slot);\n    uint8_t at = memory->used++;\n\n",
    ),
    Mutant(
        "memory-survives-reboot",
        "forgets the last slots of its memory at power-off",
        "memory.c",
        "    for (slot = 0; slot < PHYSICAL; slot++) {\n        if (intact",
        "    for (slot = 0; slot < 1; slot++) {\n        if (intact",
    ),
    Mutant(
        "contest-needs-memory",
        "starts a contest with nothing to play",
        "contest.c",
        "if (junior->memory.used == 0) {",
        "if (false) {",
    ),
    Mutant(
        "contest-countdown",
        "is too keen to wait for the end of the countdown",
        "contest.c",
        "junior->contest.begins = junior->robot.time.now + countdown;",
        "junior->contest.begins = junior->robot.time.now + countdown / 2U;",
    ),
    Mutant(
        "wheels-stand-when-stopped",
        "stays in motion when it says that it is stopped",
        "states.c",
        "    if (cell != ROBOT_STATE_DRIVING && cell != ROBOT_STATE_PERFORMING && cell != ROBOT_STATE_CONTEST) {",
        "    if (cell == ROBOT_STATE_DISARMED || cell == ROBOT_STATE_READY) {",
    ),
    Mutant(
        "actions-turn-wheels",
        "has its actions' wheels crossed",
        "maneuver.c",
        "    driving_set(junior, (int16_t)((int8_t)flash_u8(&actions[action].left) * speed),\n"
        "                (int16_t)((int8_t)flash_u8(&actions[action].right) * speed));",
        "    driving_set(junior, (int16_t)((int8_t)flash_u8(&actions[action].right) * speed),\n"
        "                (int16_t)((int8_t)flash_u8(&actions[action].left) * speed));",
    ),
    Mutant(
        "unsigned-refused",
        "believes what nobody has signed",
        "signing.c",
        "        count(&signing->not_signed);\n        return SIGNING_REFUSED;",
        "        count(&signing->not_signed);\n        return SIGNING_BELIEVED;",
        keyed=True,
    ),
    Mutant(
        "wrongly-signed-refused",
        "does not look at signatures",
        "signing.c",
        "if (!same_hash(robot, frame, length)) {",
        "if (false) {",
        keyed=True,
    ),
    Mutant(
        "replayed-refused",
        "believes what it has heard before",
        "signing.c",
        "if (!later(&time, stream != NULL ? &stream->last : &signing->floor)\n",
        "if ((stream == NULL && !later(&time, &signing->floor))\n",
        keyed=True,
    ),
    Mutant(
        "unsigned-stop-obeyed",
        "asks for a signature before it stops",
        "frame.c",
        "if (!believed && !is_stop(row, &message)) {",
        "if (!believed) {",
        keyed=True,
    ),
)
