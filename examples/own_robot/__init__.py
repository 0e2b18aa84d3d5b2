"""A robot of another make: see README.md."""
