"""Numbers that the protocol fixes: states, reasons, actions, parameters (docs/protocol.md)."""

TICK = 0.005
"""Control period in s."""
DISARMED, READY, DRIVING, PERFORMING, COUNTDOWN, CONTEST, STOPPED = range(7)
ARMED_STATES = {READY, DRIVING, PERFORMING, COUNTDOWN, CONTEST}
COMPLETED, CHANGED, REFLEX, STOPPED_EARLY, REPLACED = range(5)
NONE, NOT_ARMED, EMERGENCY, WRONG_SESSION, BAD_VALUE, BUSY, FULL, NOT_FOUND, WATCHDOG, BY_COMMAND = range(10)
OLD_SEQUENCE = 11
ACCEPTED, REJECTED, DENIED, UNSUPPORTED = range(4)
MAJOR = 2
"""Version of the protocol."""
RAREST_HEARTBEAT = 5.0
"""Longest interval of HEARTBEAT in s: a robot must remain findable."""
ANY, MAX_ACTIONS, HISTORY = 255, 8, 8
OPTION_REFLEX, OPTION_CHANGE, OPTION_HOLD = 1, 2, 16
NEXT = {  # event: next state from DISARMED, READY, DRIVING, PERFORMING, COUNTDOWN, CONTEST, STOPPED; negative: refused, why
    "arm": (READY, READY, DRIVING, PERFORMING, COUNTDOWN, CONTEST, -EMERGENCY),
    "disarm": (DISARMED,) * 7,
    "stop": (STOPPED,) * 7,
    "session": (DISARMED, DISARMED, DISARMED, DISARMED, COUNTDOWN, CONTEST, STOPPED),
    "drive": (-NOT_ARMED, DRIVING, DRIVING, DRIVING, -BUSY, -BUSY, -EMERGENCY),
    "stick": (-NOT_ARMED, DRIVING, DRIVING, -BUSY, -BUSY, -BUSY, -EMERGENCY),
    "perform": (-NOT_ARMED, PERFORMING, PERFORMING, PERFORMING, -BUSY, -BUSY, -EMERGENCY),
    "contest": (-NOT_ARMED, COUNTDOWN, COUNTDOWN, COUNTDOWN, -BUSY, -BUSY, -EMERGENCY),
    "go": (DISARMED, READY, DRIVING, PERFORMING, CONTEST, CONTEST, STOPPED),
    "end": (DISARMED, READY, DRIVING, PERFORMING, READY, READY, STOPPED),
    "done": (DISARMED, READY, READY, READY, COUNTDOWN, CONTEST, STOPPED),
    "release": (DISARMED, READY, READY, READY, COUNTDOWN, CONTEST, STOPPED),
}
SPEEDS = ("SPD_FAST", "SPD_MODERATE", "SPD_SLOW", "SPD_TURN")
ACTIONS = (  # by wire code: which speed, left wheel, right wheel
    (0, 0, 0), (1, 1, 1), (1, -1, -1), (3, -1, 1), (3, 1, -1), (0, 1, 1), (1, 1, 1), (2, 1, 1), (0, -1, -1), (1, -1, -1),
    (2, -1, -1), (3, 0, 1), (3, -1, 0), (3, -1, 1), (3, 1, 0), (3, 0, -1), (3, 1, -1),
)  # fmt: skip
TURN_LEFT, TURN_RIGHT = 3, 4
PARAMETERS = {  # name: default, least, greatest, whole numbers only
    "SYS_ID": (1, 1, 254, True), "MEM_SLOTS": (32, 1, 254, True), "SPD_FAST": (1, 0, 1, False),
    "SPD_MODERATE": (0.7, 0, 1, False), "SPD_SLOW": (0.4, 0, 1, False), "SPD_TURN": (0.35, 0, 1, False),
    "TRIM_LEFT": (1, 0.5, 1, False), "TRIM_RIGHT": (1, 0.5, 1, False), "EYE_L_ON": (250, 0, 1023, True),
    "EYE_R_ON": (250, 0, 1023, True), "EYE_HYST": (20, 0, 500, True), "FLOOR_L_OFF": (500, 0, 1023, True),
    "FLOOR_R_OFF": (500, 0, 1023, True), "FLOOR_INVERT": (0, 0, 1, True), "ARM_DEBOUNCE": (10, 0, 100, True),
    "ARM_HOLD": (100, 10, 5000, True), "REFLEX_BACK": (250, 0, 2000, True), "REFLEX_TURN": (350, 0, 2000, True),
    "REFLEX_SPEED": (0.7, 0, 1, False), "WATCHDOG": (250, 50, 2000, True), "STIM_ARMS": (0, 0, 1, True),
    "CONTEST_MAX": (180, 0, 3600, True), "BATT_LOW": (0, 0, 20000, True), "MAN_HOLD": (100, 0, 250, True),
    "WHEEL_SPEED": (400, 1, 5000, True), "FAIL_ENABLE": (0, 0, 1, True),
}  # fmt: skip
READ_ONLY = {"MEM_SLOTS"}
