"""The values of the problem: `pag.py`, `template.py`, `robot_types.py`, `plan.py`, and the ids by
which everything is named (`ids.py`)."""
