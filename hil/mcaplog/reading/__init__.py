"""What is in a log, by its index or from one end to the other."""
