"""Other people's viewers: a log, or a run that goes on, streamed to Foxglove."""
