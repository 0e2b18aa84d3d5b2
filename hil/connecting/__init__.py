"""From an address to robots: who is there, what opens a link, and what is said when nobody answers."""
