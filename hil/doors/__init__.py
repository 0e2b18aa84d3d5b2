"""The doors that files come in by: a valid object comes out, or the door's own error."""

from hil.doors.door import Document, Door
from hil.doors.parsing import DocumentError, parse_json

__all__ = ["Document", "DocumentError", "Door", "parse_json"]
