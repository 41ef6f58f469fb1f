"""Triangle meshes as any program has them: `triangles.py` computes with vertices and faces,
`bodies.py` and `merging.py` separate and join, `alike.py` compares, `mesh_reader.py` reads
files."""
