"""Junior, as a program on the PC holds it, and what it is used for: bouts, coaching, contests."""
