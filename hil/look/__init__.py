"""What is shown of a run: a scene gathered from a log, and one page that plays it."""

from __future__ import annotations
