"""Where and how each robot holds what it carries, chosen from the geometry of the parts."""
