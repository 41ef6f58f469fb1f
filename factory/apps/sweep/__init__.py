"""Sweeps: runs over a grid of seeds, speeds, clearances, ..., by processes, into an
SQLite database from which a stopped sweep resumes.

    >>> from factory.apps.sweep import points, read_axes
    >>> [dict(point) for point in points(read_axes(["seed=0:2", "jitter=0.1"]))]
    [{'jitter': 0.1, 'seed': 0}, {'jitter': 0.1, 'seed': 1}]

`sweep(Recipe(...), axes, database, jobs)` runs one; `summarise(database)` gives means, standard
deviations and confidence intervals.
"""

from factory.apps.sweep.grid import GridAxis, points, read_axes
from factory.apps.sweep.recipe import Recipe
from factory.apps.sweep.summary import Summary, summarise
from factory.apps.sweep.sweeping import Tally, sweep

__all__ = ["GridAxis", "Recipe", "Summary", "Tally", "points", "read_axes", "summarise", "sweep"]
