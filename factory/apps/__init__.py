"""Apps: each uses the core, and the core knows none."""
