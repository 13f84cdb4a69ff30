"""One module per command: ``register`` its arguments, run it, return an exit code."""
