"""What takes the entries of a log: a file's writer does, and so does what compares them with those of another log."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from hil.mcaplog.schemas import Schema
    from hil.mcaplog.writing.row_encoding import EntryRows


class LogSink(Protocol):
    """Takes a log's entries in order; see `hil.mcaplog.writing.writer.LogWriter`."""

    def channel(self, topic: str, schema: Schema) -> int:
        """The channel of a topic."""
        ...

    def raw_channel(
        self, topic: str, schema_name: str, schema: bytes, *, schema_encoding: str = "protobuf", encoding: str = "protobuf"
    ) -> int:
        """As `channel`, from a ready schema."""
        ...

    def write(self, channel: int, time: float, data: bytes) -> None:
        """Take an entry; time is its log time in s."""
        ...

    def write_rows(self, parts: Sequence[EntryRows]) -> None:
        """Take many entries, in the order of their places."""
        ...

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Take a metadata record."""
        ...

    def attachment(self, name: str, data: bytes, *, media_type: str, time: float) -> None:
        """Take an attachment."""
        ...

    def flush(self) -> None:
        """Hand everything on."""
        ...

    def close(self) -> None:
        """There is no more."""
        ...

    def discard(self) -> None:
        """Nothing of it is wanted."""
        ...
