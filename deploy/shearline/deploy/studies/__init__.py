"""Studies that run through the whole system: what they hand out, and how they are led."""
