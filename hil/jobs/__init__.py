"""What the verbs do once it is known what is asked of them: with a robot now, or with the log of one."""

from hil.jobs.stage import Job, Stage

__all__ = ["Job", "Stage"]
