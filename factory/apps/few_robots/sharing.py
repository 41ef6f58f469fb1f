"""The projects in which robots are shared: lines, parallel branches, tees."""

from __future__ import annotations

from collections.abc import Sequence

from factory.api import Project
from factory.apps.few_robots.folding import fold, lines_of_labels
from factory.apps.few_robots.parallel import Branches, in_parallel
from factory.apps.few_robots.tees import with_tees as tees_in_plan


def with_lines(project: Project, lines: Sequence[Sequence[str]]) -> Project:
    """The project in which the robots that bring the labels of a line are one robot. Raises
    InputError (BadLine)."""
    if not lines:
        return project
    factory = project.planned
    sides = lines_of_labels(factory, lines)
    return project.with_plan(fold(factory, sides, project.catalogue))


def with_branches(project: Project, branches: Branches) -> Project:
    """The project in which the branches that bring some labels are there several times. Raises
    InputError (Parallel)."""
    return project.with_plan(in_parallel(project.planned, branches))


def with_tees(project: Project, stems: Sequence[Sequence[str]]) -> Project:
    """The project in which two robots share a stem, by the labels that they bring. Raises
    InputError (BadTee)."""
    return project.with_plan(tees_in_plan(project.planned, stems, project.catalogue))
