"""Where parts in place come from: a folder of meshes, a scene file, an LDraw model, a PAG."""
