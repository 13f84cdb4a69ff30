"""Replay on the command line: from a run folder to cases, to many processes, to words and views."""
