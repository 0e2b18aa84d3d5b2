"""Questions that are repeated until they are answered: of any robot."""
