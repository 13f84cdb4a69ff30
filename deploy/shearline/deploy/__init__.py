"""What a person types: command line, local launcher, doctor."""
