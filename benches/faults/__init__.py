"""What becomes of factories in which things go wrong."""
