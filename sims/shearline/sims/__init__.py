"""What a skill acts on: robot, lock, key, scenes and plants. No skill and no task lives here."""
