"""Files that people name, to be read or written."""
