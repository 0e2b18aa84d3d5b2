"""The recorder of a sumo robot's sessions: what passes the bridge, and above it what the run has to say."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.messages import HOST_COMPONENT, HOST_SYSTEM
from hil.recording.sumo_drawing import SumoDrawing
from hil.recording.sumo_log import SumoLog
from hil.recording.wire_log import WireLog

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from hil.mcaplog.sink import LogSink


class Recorder(WireLog, SumoLog):
    """Writes everything that passes the bridge, and what the learner does, into a log.

    What passes is recorded as the bridge tells it: of signing keys it tells nothing but zeros.

    Log times are the bridge's clock readings and the stamps of received chunks. A failure to write raises once; from then
    on the recorder is silent, so that the robot can be stopped through the same bridge.

    Args:
        path: The log file.
        run: Whatever differs between two runs of the same seed: wall clock, command line, paths.
        config: Program version, protocol version, seed, configuration; as text.
        link: Name of the network: the address of its link. Of several, that of the first.
        lockstep: The link is in lock-step.
        system: MAVLink system id of the host.
        component: MAVLink component id of the host.
        overwrite: A file that exists is replaced, when the log is whole.
        on_failure: Is told, in words, when the disk does not take any more, and which file holds what there is of the log
            (None: no file does); the run goes on without a log.
        writer: Takes the entries; None writes them to `path`.

    Attributes:
        now: Log time of what is noted, in s: the last step's reading of the clock.

    Raises:
        OutputExistsError: There is a file already, and it may not be replaced.
        LogError: The file cannot be created.
    """

    def __init__(
        self,
        path: Path,
        *,
        run: Mapping[str, str],
        config: Mapping[str, str],
        link: str,
        lockstep: bool,
        system: int = HOST_SYSTEM,
        component: int = HOST_COMPONENT,
        overwrite: bool = False,
        on_failure: Callable[[str, Path | None], None] | None = None,
        writer: LogSink | None = None,
    ) -> None:
        super().__init__(
            path,
            run=run,
            config=config,
            link=link,
            lockstep=lockstep,
            system=system,
            component=component,
            overwrite=overwrite,
            on_failure=on_failure,
            writer=writer,
            drawing=SumoDrawing,
        )
