"""The doors that files come in by: a valid object comes out, or the door's own error."""

from hil.doors.door import Document, Door, checkpoint_door
from hil.doors.parsing import DocumentError, parse_json

__all__ = ["Document", "DocumentError", "Door", "checkpoint_door", "parse_json"]
