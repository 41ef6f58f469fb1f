"""Where things go wrong in the engine."""
