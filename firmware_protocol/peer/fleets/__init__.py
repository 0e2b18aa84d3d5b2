"""Many robots of one network as arrays: what all of them say and are told, in rounds."""
