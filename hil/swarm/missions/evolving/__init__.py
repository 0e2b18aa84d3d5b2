"""The search for the conditions that suit a group best (Liu & Wu 2001, ch. 9): evaluations, what was found, checkpoints."""
