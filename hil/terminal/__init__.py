"""Keys, and what signals ask for."""
