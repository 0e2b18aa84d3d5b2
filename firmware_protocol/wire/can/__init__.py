"""CAN without I/O: frames, identifiers, transfers and codecs."""
