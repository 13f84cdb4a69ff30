"""The run at rest: one MCAP of every message, trace and learner snapshot."""
