"""Coaching against robots: who Junior meets, and the ring where somebody plays the other robot meanwhile."""
