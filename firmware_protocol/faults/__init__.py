"""What goes wrong on purpose, as data and as text."""
