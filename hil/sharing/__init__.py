"""A link that other programs look on at: what passes is copied out to them, and what they ask is answered for the robots."""
