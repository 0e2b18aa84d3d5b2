"""The firmware on a bench, on a CAN bus."""

from __future__ import annotations

from firmware_bench import FirmwareBench

from firmware_protocol.messages import RobotStatus
from firmware_protocol.wire.can.dbc import CanCodec
from firmware_protocol.wire.can.frame import CanFrame, pack_frames, split_records
from simdevice._host import ffi


class CanBench(FirmwareBench):
    """One robot, node 1 of a bus."""

    def power_on(self, nvm: bytes | None = None) -> None:
        """Cut the power and give it back."""
        self.io.can = 1
        super().power_on(nvm)
        self.host = CanCodec(system=255, component=190)
        self._codec = CanCodec(system=255, component=190)

    def frames(self, *frames: CanFrame) -> list[CanFrame]:
        """One control period in which these frames arrive; returns those that are sent."""
        self.tick(raw=pack_frames(frames))
        return [CanFrame.unpack(record) for record in split_records(bytes(ffi.buffer(self.io.tx, self.io.tx_len)))]

    def counters(self) -> tuple[int, int, int, int]:
        """Good, bad checksum, unknown, lost; as the robot says by itself once a second."""
        self.run(1000, alive=False)
        status = self.latest(RobotStatus)
        return status.good, status.bad_checksum, status.unknown, status.lost
