"""Solids of parts: from PAG and mesh files to bodies with mass and inertia, the convex pieces that
collide for them (`pieces.py`, `decomposition.py`), and overlaps between them (`overlap.py`)."""
