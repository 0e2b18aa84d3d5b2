"""A short animation of a scene, as a picture that goes anywhere: a bout, or a swarm's run."""

from __future__ import annotations
