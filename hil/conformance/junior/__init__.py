"""Checks that are for a Junior alone."""
