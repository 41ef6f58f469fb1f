"""The model of a factory in MJCF, which is written here only.

`model.py` (`build_model`) calls the writers of what stands on the floor, one module each:
`scene.py`, `robot_bodies.py` with `robots.py`, `hands.py` and `tools.py`, `feeders.py`,
`outfeed.py`, `bins.py`, `parts.py`, and `welds.py`. `names.py` makes and reads all names,
`driving.py` and `timestep.py` size drives and the timestep, `loading.py` compiles the model.

Colours: a part's is its `rgba` (`floor/geometry/solids.py`, `colour`); machines have the materials
of `skeleton.xml` and of their type's file, and the paint of their role (`ROLES` in `robots.py`).
Films paint machines anew by `film/look.py`.
"""
