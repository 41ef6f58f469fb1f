"""Where things go wrong in the engine: what is done to bodies, what is sensed, what is cleared away."""
