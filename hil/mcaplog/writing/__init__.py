"""From records to a file in chunks, with its indexes and summary."""
