"""Runs in MuJoCo and in the ideal world: the model, the worlds, the supervisor, the record."""
