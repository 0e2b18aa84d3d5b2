"""The firmware on a bench, on a CAN bus."""

from __future__ import annotations

from firmware_bench import FirmwareBench

from firmware_protocol.can_frame import CanFrame, pack_frames, split_records
from firmware_protocol.dbc import CanCodec
from firmware_protocol.firmware._host import ffi
from firmware_protocol.messages import Command, CommandLong, RobotStatus


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
        """Good, bad checksum, unknown, lost; before the request that asks for them."""
        self.tick(CommandLong(1, 1, command=int(Command.REQUEST_MESSAGE), param1=RobotStatus.ID))
        status = self.latest(RobotStatus)
        return status.good - 1, status.bad_checksum, status.unknown, status.lost
