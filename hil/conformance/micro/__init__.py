"""Checks that are for a micro-robot alone."""
