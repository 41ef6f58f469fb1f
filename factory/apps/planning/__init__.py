"""From parts in place to an assembly tree: the sources, the geometry of blocking, the search."""
