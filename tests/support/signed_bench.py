"""The firmware on a bench, with a signing key."""

from __future__ import annotations

from firmware_bench import BLANK, FirmwareBench
from signed_pair import KEY, NOW, signed_codec

from firmware_protocol.messages import Ping, RobotStatus
from firmware_protocol.wire.mavlink import MavlinkCodec
from firmware_protocol.wire.signing import SigningKey, setup_signing
from simdevice._host import ffi, lib

AHEAD = 458 << 16
"""How far ahead the robot stores its time, in 10 us."""


class SignedBench(FirmwareBench):
    """A robot, and a host that signs; the host's clock is the robot's time since power-on, from `NOW` on."""

    def __init__(self, key: SigningKey | None = KEY, nvm: bytes = BLANK, host_key: SigningKey = KEY) -> None:
        super().__init__(nvm)
        if key is not None:
            lib.host_give_key(self.robot, key.secret)
            self.power_on()
        self.sign(host_key)

    def sign(self, key: SigningKey | None, now: int = NOW, system: int = 255) -> None:
        """Sign with this key from now on, beginning at this time; None: do not."""
        self.host = MavlinkCodec(system=255, component=190) if key is None else signed_codec(key, now=now, system=system)

    def refused(self) -> tuple[int, int, int]:
        """Not signed, wrongly signed, replayed; as the robot says by itself once a second."""
        self.run(1100, alive=False)
        status = self.latest(RobotStatus)
        return status.not_signed, status.bad_signature, status.replayed

    def answers(self, raw: bytes) -> list[int]:
        """Numbers of the pings answered when these bytes come."""
        return [answer.seq for answer in self.tick(raw=raw) if isinstance(answer, Ping)]

    def give(self, key: SigningKey | None, *, system: int = 1) -> None:
        """Send a key, or its removal, and let the robot store it."""
        self.tick(setup_signing(system, key, NOW if key else 0))
        self.run(400, alive=False)

    def signs(self) -> bool:
        """Whether what the robot says is signed."""
        codec = MavlinkCodec(system=1, component=1)
        self.now += 1000
        length = lib.host_tick(self.robot, self.now * 1000, b"", 0)
        codec.receive(bytes(ffi.buffer(self.io.tx, length)), 0.0)
        assert codec.good
        assert codec.signed in {0, codec.good}
        return codec.signed > 0
