"""Propose tuples and keep the run: learners, dispatcher, journal."""
