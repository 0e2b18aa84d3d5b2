"""Robots against robots: who enters, who meets whom, how strong each is, and which bouts were surprises."""
